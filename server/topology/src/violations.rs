//! Every identity that a map must keep.

use std::fmt;

use crate::map::SIDE;
use crate::orbit::Walk;
use crate::slots::{NONE, UNSETTLED};
use crate::{AnyCell, Dart, Dimension, Map};

/// A broken identity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Violation {
    /// β1 is free, or leads to a dart that does not exist, or two darts lead to the same: the face is not closed.
    OpenFace {
        /// The dart.
        dart: Dart,
    },
    /// β2 or β3 is no involution, or has a fixed point.
    NoInvolution {
        /// 2 or 3.
        beta: u8,
        /// The dart.
        dart: Dart,
    },
    /// β1∘β3 is no involution: the two sides of a face do not run against each other.
    SidesDiffer {
        /// The dart.
        dart: Dart,
    },
    /// β2 is free in a 3-map, or β3 is not in a 2-map.
    WrongBoundary {
        /// The dart.
        dart: Dart,
    },
    /// Two darts of one orbit are in different cells.
    Torn {
        /// The one dart.
        dart: Dart,
        /// Its cell.
        cell: AnyCell,
        /// The other dart.
        other: Dart,
    },
    /// A cell of two orbits.
    Shared {
        /// The cell.
        cell: AnyCell,
        /// A dart of the second orbit.
        dart: Dart,
    },
    /// A dart that is in no cell of some dimension.
    Homeless {
        /// The dart.
        dart: Dart,
        /// 0 to 3.
        dimension: usize,
    },
    /// A cell whose dart is not one of it, or is inside an edge that has ends; or a live slot without darts.
    Misnamed {
        /// The cell.
        cell: AnyCell,
    },
    /// Both sides of a face have the same label, or one side's label stands on the other's ring.
    SidesMixed {
        /// The dart.
        dart: Dart,
    },
    /// Slots that are neither of a cell nor free, or both.
    Miscounted {
        /// 0 to 3; 4 for darts.
        dimension: usize,
        /// How many live ones there should be by the free lists.
        expected: usize,
        /// How many there are.
        found: usize,
    },
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OpenFace { dart } => write!(f, "β1({dart}): the face is not closed"),
            Self::NoInvolution { beta, dart } => {
                write!(f, "β{beta}({dart}): no involution without fixed points")
            }
            Self::SidesDiffer { dart } => write!(f, "β1∘β3({dart}): no involution"),
            Self::WrongBoundary { dart } => write!(f, "{dart}: free or not against the dimension"),
            Self::Torn { dart, cell, other } => {
                write!(f, "{dart} is in {cell}, {other} of the same orbit is not")
            }
            Self::Shared { cell, dart } => write!(f, "{cell} has a second orbit, with {dart}"),
            Self::Homeless { dart, dimension } => {
                write!(f, "{dart} is in no cell of dimension {dimension}")
            }
            Self::Misnamed { cell } => write!(f, "{cell} is named after a dart that is not its"),
            Self::SidesMixed { dart } => write!(f, "{dart}: the sides of its face are mixed up"),
            Self::Miscounted {
                dimension,
                expected,
                found,
            } => write!(
                f,
                "dimension {dimension}: {found} live slots, where the free ones leave {expected}"
            ),
        }
    }
}

impl Map {
    /// Every broken identity, of links first: cells are looked at only where links are sound. Looks at every dart.
    pub fn violations(&self) -> Vec<Violation> {
        let mut found = Vec::new();
        self.link_violations(&mut found);
        if found.is_empty() {
            let mut walk = Walk::default();
            for dimension in 0..4 {
                self.cell_violations(dimension, &mut walk, &mut found);
            }
            self.side_violations(&mut found);
        }
        self.slot_violations(&mut found);
        found
    }

    fn link_violations(&self, found: &mut Vec<Violation>) {
        let mut reached = vec![false; self.dart_slot_count()];
        let is_live = |dart: Dart| self.dart_at(dart.index()).is_some();
        for dart in self.darts() {
            match self.beta[0][dart.index()] {
                Some(next) if is_live(next) && !reached[next.index()] => {
                    reached[next.index()] = true;
                }
                Some(_) | None => found.push(Violation::OpenFace { dart }),
            }
            for beta in [2, 3] {
                let column = &self.beta[usize::from(beta) - 1];
                let Some(other) = column[dart.index()] else {
                    continue;
                };
                let returns = is_live(other) && column[other.index()] == Some(dart);
                if !returns || other == dart {
                    found.push(Violation::NoInvolution { beta, dart });
                }
            }
            let is_wrong = match self.dimension {
                Dimension::Two => self.beta3(dart).is_some(),
                Dimension::Three => self.beta2(dart).is_none(),
            };
            if is_wrong {
                found.push(Violation::WrongBoundary { dart });
            }
        }
        if !found.is_empty() {
            return;
        }
        for dart in self.darts() {
            let then = |dart: Dart| self.beta3(dart).map(|beyond| self.beta1(beyond));
            if self.beta3(dart).is_some() && then(dart).and_then(then) != Some(dart) {
                found.push(Violation::SidesDiffer { dart });
            }
        }
    }

    fn cell_violations(&self, dimension: usize, walk: &mut Walk, found: &mut Vec<Violation>) {
        let mut settled = vec![false; self.dart_slot_count()];
        let mut first = vec![None; self.slots[dimension].dart.len()];
        for dart in self.darts() {
            if settled[dart.index()] {
                continue;
            }
            let label = self.label_in(dimension, dart);
            if label as usize >= first.len() {
                found.push(Violation::Homeless { dart, dimension });
                continue;
            }
            let cell = AnyCell::of(dimension, label);
            let name = self.slots[dimension].dart[label as usize];
            let (mut is_named, mut has_ends) = (false, false);
            for &other in walk.collect(self, dimension, dart) {
                settled[other.index()] = true;
                is_named |= name == Some(other);
                has_ends |= dimension == 1 && self.beta3(other).is_none();
                if self.label_in(dimension, other) != label {
                    found.push(Violation::Torn { dart, cell, other });
                }
            }
            if first[label as usize].replace(dart).is_some() {
                found.push(Violation::Shared { cell, dart });
            } else if !is_named || has_ends && name.and_then(|name| self.beta3(name)).is_some() {
                found.push(Violation::Misnamed { cell });
            }
        }
        let slots = self.slots[dimension].dart.iter().zip(&first);
        for (label, _) in (0u32..)
            .zip(slots)
            .filter(|(_, (name, first))| name.is_some() != first.is_some())
        {
            let cell = AnyCell::of(dimension, label);
            found.push(Violation::Misnamed { cell });
        }
    }

    fn side_violations(&self, found: &mut Vec<Violation>) {
        let side = |dart: Dart| self.label[SIDE][dart.index()];
        for dart in self.darts() {
            let along = side(self.beta1(dart)) == side(dart);
            let beyond = self
                .beta3(dart)
                .is_none_or(|other| side(other) == side(dart) ^ 1);
            let sound = side(dart) < UNSETTLED && along && beyond;
            if !sound {
                found.push(Violation::SidesMixed { dart });
            }
        }
        let mut used = vec![false; self.side_volume.len()];
        for dart in self.darts() {
            if let Some(used) = used.get_mut(side(dart) as usize) {
                *used = true;
            }
        }
        for (index, (&volume, used)) in self.side_volume.iter().zip(used).enumerate() {
            if !used && volume != NONE {
                let face = u32::try_from(index / 2).unwrap_or(NONE);
                let cell = AnyCell::of(2, face);
                found.push(Violation::Misnamed { cell });
            }
        }
    }

    fn slot_violations(&self, found: &mut Vec<Violation>) {
        let mut compare = |dimension, expected, live| {
            if expected != live {
                let found_live = live;
                found.push(Violation::Miscounted {
                    dimension,
                    expected,
                    found: found_live,
                });
            }
        };
        for (dimension, slots) in self.slots.iter().enumerate() {
            let live = slots.dart.iter().flatten().count();
            compare(dimension, slots.live(), live);
        }
        compare(4, self.dart_count(), self.darts().count());
    }
}
