use crate::MappingError;

/// The greatest cost of an arc, and the greatest start of a flood: sums of them stay finite, and so do their squares.
const LARGEST: f64 = 1e100;

/// Costs are rounded to so many bits below the leading one of the greatest. Sums of up to 2¹² times the greatest are then
/// exact: paths of equal length tie, whatever the order of their arcs.
const BITS: u32 = 40;

/// The range of costs where each arc costs 1.
const HOPS: [f64; 2] = [1.0, 1.0];

/// Rows of numbers in one array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rows {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Default for Rows {
    /// No rows.
    fn default() -> Self {
        Self {
            starts: vec![0],
            items: Vec::new(),
        }
    }
}

impl Rows {
    /// Row i is `items[starts[i]..starts[i + 1]]`.
    ///
    /// # Panics
    /// If `starts` does not rise from 0 to the number of items.
    #[must_use]
    pub fn new(starts: Vec<u32>, items: Vec<u32>) -> Self {
        let last = starts.last().copied();
        assert!(
            starts.first() == Some(&0)
                && starts.is_sorted()
                && last.map(|end| end as usize) == Some(items.len()),
            "rows start at 0, rise, and end with the items"
        );
        Self { starts, items }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The items of a row.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.items[self.span(row)]
    }

    /// All items, row by row.
    #[must_use]
    pub fn items(&self) -> &[u32] {
        &self.items
    }

    pub(crate) fn span(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }
}

/// What a flood spreads over: nodes, and arcs between them that cost the same both ways.
///
/// Two cells of a mesh with no arc between them, such as the two sides of a tear, are no neighbours: a flood goes round.
#[derive(Clone, Debug)]
pub struct Graph {
    arcs: Rows,
    /// One per arc.
    costs: Vec<f64>,
    /// The least and the greatest cost.
    range: [f64; 2],
    /// What costs are multiples of.
    ticks: Ticks,
    /// Arcs that cost no less than the power of two below the greatest, before costs were rounded.
    peaks: usize,
}

impl Graph {
    /// A graph of `arcs.len()` nodes, whose neighbours are the rows, each arc in both directions.
    ///
    /// * `costs` – one per item of `arcs`, 0 to 1e100, the same both ways; empty for 1 each. They are rounded to 40 bits
    ///   below the greatest, so that equal paths tie.
    ///
    /// # Errors
    /// Costs that are none or not as many as arcs, and neighbours that do not exist.
    pub fn new(arcs: Rows, mut costs: Vec<f64>) -> Result<Self, MappingError> {
        let nodes = arcs.len();
        if let Some(&node) = arcs.items.iter().find(|&&end| end as usize >= nodes) {
            return Err(MappingError::Node { node, nodes });
        }
        if costs.is_empty() {
            return Ok(Self {
                costs: vec![1.0; arcs.items.len()],
                range: HOPS,
                ticks: Ticks::below(1.0),
                peaks: arcs.items.len(),
                arcs,
            });
        }
        let (found, expected) = (costs.len(), arcs.items.len());
        if found != expected {
            let what = "costs of arcs";
            return Err(MappingError::Length {
                what,
                found,
                expected,
            });
        }
        if let Some(arc) = costs
            .iter()
            .position(|cost| !(0.0..=LARGEST).contains(cost))
        {
            let value = costs[arc];
            return Err(MappingError::Cost { arc, value });
        }
        let greatest = costs.iter().copied().fold(0.0, f64::max);
        let ticks = Ticks::below(greatest);
        let peaks = costs.iter().filter(|cost| ticks.is_peak(**cost)).count();
        costs.iter_mut().for_each(|cost| *cost = ticks.round(*cost));
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let range = [least, costs.iter().copied().fold(0.0, f64::max)];
        Ok(Self {
            arcs,
            costs,
            range,
            ticks,
            peaks,
        })
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.arcs.len()
    }

    /// Whether there is no node.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.arcs.is_empty()
    }

    /// The neighbours of a node.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn neighbours(&self, node: usize) -> &[u32] {
        self.arcs.row(node)
    }

    /// The neighbours of a node with the costs of the arcs to them.
    pub(crate) fn arcs(&self, node: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
        let span = self.arcs.span(node as usize);
        let ends = self.arcs.items[span.clone()].iter().copied();
        ends.zip(self.costs[span].iter().copied())
    }

    /// The least and the greatest cost of an arc.
    pub(crate) fn range(&self) -> [f64; 2] {
        self.range
    }

    /// What costs are rounded to, and how many arcs decide that.
    pub(crate) fn ticks(&self) -> (Ticks, usize) {
        (self.ticks, self.peaks)
    }

    /// The start of a flood in the units of the arcs.
    pub(crate) fn round(&self, start: f64) -> f64 {
        if self.range == HOPS {
            return start;
        }
        Ticks::below(self.range[1]).round(start)
    }
}

/// A power of two, of which costs are multiples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ticks {
    tick: f64,
}

impl Ticks {
    pub(crate) fn below(greatest: f64) -> Self {
        let power = f64::from_bits(greatest.to_bits() & f64::INFINITY.to_bits());
        Self {
            tick: power / (1_u64 << BITS) as f64,
        }
    }

    /// The power of two that the greatest cost is not below.
    fn power(&self) -> f64 {
        self.tick * (1_u64 << BITS) as f64
    }

    /// Whether a greatest cost like this makes such ticks, or finer ones would not do.
    pub(crate) fn is_peak(&self, cost: f64) -> bool {
        cost >= self.power()
    }

    /// Whether a greatest cost like this asks for coarser ticks.
    pub(crate) fn is_beyond(&self, cost: f64) -> bool {
        cost >= 2.0 * self.power()
    }

    pub(crate) fn round(&self, cost: f64) -> f64 {
        let ticks = cost / self.tick;
        // Beyond 2⁵² every number is whole; where all costs vanish, so does the tick.
        if ticks < (1_u64 << 52) as f64 {
            ticks.round() * self.tick
        } else {
            cost
        }
    }
}
