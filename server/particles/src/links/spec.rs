use crate::check::{self, Checked, NOT_NEGATIVE, not_negative};

/// Links of one law between pairs of particles, any topology.
#[derive(Clone, Debug, PartialEq)]
pub struct Links {
    /// The two particles of each link.
    pub ends: Vec<[u32; 2]>,
    /// What the links do.
    pub law: LinkLaw,
}

/// What a link does with its length, the distance between its ends. Columns have one entry per link.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkLaw {
    /// A damped spring; a damper where the stiffness is 0. `[P1]`
    Spring(Elastic),
    /// A damped spring while shorter than its rest length, nothing while longer; it never pulls. `[P6]`
    Contact(Elastic),
    /// A damped spring until it is stretched too far; then nothing, for ever. `[P7]`
    Breaking {
        /// The spring.
        elastic: Elastic,
        /// Elongation beyond which a link breaks, m, ≥ 0.
        elongations: Vec<f64>,
    },
    /// A damped spring whose rest length follows where it is strained too far: it keeps the shape it was forced into.
    /// `[P8]`
    Plastic {
        /// The spring.
        elastic: Elastic,
        /// Elongation, of either sign, beyond which a link flows, m, ≥ 0.
        yields: Vec<f64>,
    },
    /// Dry friction: a spring on the whole relative position of the ends whose anchor slips where it would pull harder
    /// than a limit. `[P9]`
    Friction {
        /// N/m, > 0: how much a link gives before it slips.
        stiffness: Vec<f64>,
        /// N, ≥ 0: the greatest friction.
        limits: Vec<f64>,
    },
    /// A force that is piecewise linear in the length; beyond the table its outer segments go on. `[P10]`
    Table {
        /// m, each above the one before, at least two.
        lengths: Vec<f64>,
        /// N, one per length; positive pushes apart.
        forces: Vec<f64>,
    },
}

/// The columns of damped springs, one entry per link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elastic {
    /// N/m, ≥ 0.
    pub stiffness: Vec<f64>,
    /// N s/m along the link, ≥ 0; empty for none at all.
    pub damping: Vec<f64>,
    /// m, ≥ 0; `None` for the distances at the start.
    pub rest_lengths: Option<Vec<f64>>,
}

impl Elastic {
    fn check(&self, field: &str, links: usize) -> Checked {
        let Self {
            stiffness,
            damping,
            rest_lengths,
        } = self;
        column(field, "stiffness", stiffness, links)?;
        if !damping.is_empty() {
            column(field, "damping", damping, links)?;
        }
        rest_lengths
            .iter()
            .try_for_each(|lengths| column(field, "rest_lengths", lengths, links))
    }
}

/// One number, finite and not below 0, for each link.
fn column(field: &str, name: &str, values: &[f64], links: usize) -> Checked {
    let field = format!("{field}.{name}");
    check::length(&field, values.len(), links, "links")?;
    check::column(&field, values, not_negative, NOT_NEGATIVE)
}

impl Links {
    /// `field` is the path of the batch; a column's is below it and its law, such as `links[2].spring.stiffness`.
    pub(crate) fn check(&self, field: &str, particles: usize) -> Checked {
        let links = self.ends.len();
        let field_of = |law: &str| format!("{field}.{law}");
        match &self.law {
            LinkLaw::Spring(elastic) => elastic.check(&field_of("spring"), links)?,
            LinkLaw::Contact(elastic) => elastic.check(&field_of("contact"), links)?,
            LinkLaw::Breaking {
                elastic,
                elongations,
            } => {
                let field = field_of("breaking");
                elastic.check(&field, links)?;
                column(&field, "elongations", elongations, links)?;
            }
            LinkLaw::Plastic { elastic, yields } => {
                let field = field_of("plastic");
                elastic.check(&field, links)?;
                column(&field, "yields", yields, links)?;
            }
            LinkLaw::Friction { stiffness, limits } => {
                let field = field_of("friction");
                let of_stiffness = format!("{field}.stiffness");
                check::length(&of_stiffness, stiffness.len(), links, "links")?;
                check::column(&of_stiffness, stiffness, check::positive, check::POSITIVE)?;
                column(&field, "limits", limits, links)?;
            }
            LinkLaw::Table { lengths, forces } => table(&field_of("table"), lengths, forces)?,
        }
        check::ends(&format!("{field}.ends"), &self.ends, particles)
    }
}

fn table(field: &str, lengths: &[f64], forces: &[f64]) -> Checked {
    let of_lengths = format!("{field}.lengths");
    let segments = lengths.len().max(2);
    check::length(&of_lengths, lengths.len(), segments, "ends of a segment")?;
    let of_forces = format!("{field}.forces");
    check::length(&of_forces, forces.len(), lengths.len(), "lengths")?;
    let mut last = -1.0;
    for (entry, &length) in lengths.iter().enumerate() {
        let rule = "finite, not below 0 and above the one before it";
        let admits = |length: f64| not_negative(length) && length > last;
        check::number(&format!("{of_lengths}[{entry}]"), length, admits, rule)?;
        last = length;
    }
    check::column(&of_forces, forces, f64::is_finite, "finite")
}
