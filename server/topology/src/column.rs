//! Attributes of cells.

use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

use crate::{AnyCell, Cell, Changes, Event, Kind, Map};

/// What becomes of a cell's value when cells are split, merged or made.
#[derive(Clone, Copy, Debug)]
pub struct Rules<T> {
    /// The value of a cell that was split from one with this value. The old one keeps its own.
    pub split: fn(&T) -> T,
    /// The value of a cell that another dies into: its own first, then the other's.
    pub merge: fn(&T, &T) -> T,
    /// The value of a new cell within one of a higher dimension, or in nothing. Of a vertex, given the values of those
    /// that it stands in the midst of; else given none.
    pub make: fn(&[T]) -> T,
}

/// One value per `K`-cell, freed slots included.
#[derive(Clone, Debug, PartialEq)]
pub struct Column<K, T> {
    values: Vec<T>,
    kind: PhantomData<fn() -> K>,
}

impl<K: Kind, T: Clone> Column<K, T> {
    /// A column with `value` in every slot.
    pub fn new(map: &Map, value: T) -> Self {
        Self::from_values(vec![value; map.slot_count::<K>()])
    }

    /// A column of values by slot. A cell beyond them has none: see [`Index`].
    pub fn from_values(values: Vec<T>) -> Self {
        let kind = PhantomData;
        Self { values, kind }
    }

    /// The values, by slot. Those of slots without a cell mean nothing.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// Follows an edit: every edit of the map, in order.
    ///
    /// # Panics
    /// If an edit before was not followed, so that a value is missing.
    pub fn follow(&mut self, changes: &Changes, rules: &Rules<T>) {
        for event in &changes.events {
            match event {
                Event::Born {
                    cell,
                    parent,
                    among,
                } => {
                    let Some(slot) = slot_of::<K>(*cell) else {
                        continue;
                    };
                    let value = match parent.and_then(slot_of::<K>) {
                        Some(parent) => (rules.split)(&self.values[parent]),
                        None => {
                            let among = among.start as usize..among.end as usize;
                            let around = changes.among[among].iter();
                            let values: Vec<_> = match K::DIMENSION {
                                0 => around.map(|v| self.values[v.index()].clone()).collect(),
                                _ => Vec::new(),
                            };
                            (rules.make)(&values)
                        }
                    };
                    if slot < self.values.len() {
                        self.values[slot] = value;
                    } else {
                        // Slots are taken without gaps.
                        self.values.resize(slot + 1, value);
                    }
                }
                Event::Died { cell, heir } => {
                    let heir = heir.and_then(slot_of::<K>);
                    if let (Some(slot), Some(heir)) = (slot_of::<K>(*cell), heir) {
                        self.values[heir] = (rules.merge)(&self.values[heir], &self.values[slot]);
                    }
                }
            }
        }
    }
}

/// The slot of a cell of kind `K`.
fn slot_of<K: Kind>(cell: AnyCell) -> Option<usize> {
    let (dimension, slot) = match cell {
        AnyCell::Vertex(cell) => (0, cell.index()),
        AnyCell::Edge(cell) => (1, cell.index()),
        AnyCell::Face(cell) => (2, cell.index()),
        AnyCell::Volume(cell) => (3, cell.index()),
    };
    (dimension == K::DIMENSION).then_some(slot)
}

impl<K, T> Index<Cell<K>> for Column<K, T> {
    type Output = T;

    fn index(&self, cell: Cell<K>) -> &T {
        &self.values[cell.index()]
    }
}

impl<K, T> IndexMut<Cell<K>> for Column<K, T> {
    fn index_mut(&mut self, cell: Cell<K>) -> &mut T {
        &mut self.values[cell.index()]
    }
}
