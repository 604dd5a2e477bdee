//! What names a dart or a cell.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;
use std::num::NonZeroU32;

/// A dart: one edge of one face of one volume, with a direction. Never null: "free under β" is `None`, and costs no
/// space.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Dart(NonZeroU32);

const _: () = assert!(size_of::<Option<Dart>>() == 4);

impl Dart {
    /// The most darts that a map can have, which leaves room for a side of a face, and for two marks, in 32 bits.
    pub(crate) const MOST: usize = (u32::MAX / 4) as usize - 1;

    pub(crate) fn at(index: usize) -> Self {
        let number = u32::try_from(index + 1).ok().and_then(NonZeroU32::new);
        Self(number.expect("no dart is made beyond Dart::MOST"))
    }

    /// As [`Dart::at`] of `index` and every one of `more`, for columns: without a check for each.
    pub(crate) fn beyond(
        index: usize,
        more: &[u32],
    ) -> impl ExactSizeIterator<Item = Option<Self>> {
        let first = Self::at(index).0.get();
        more.iter()
            .map(move |more| NonZeroU32::new(first + more).map(Self))
    }

    /// The dart's row in the map's columns.
    pub fn index(self) -> usize {
        self.0.get() as usize - 1
    }
}

impl fmt::Debug for Dart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "d{}", self.index())
    }
}

impl fmt::Display for Dart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

mod sealed {
    pub trait Sealed {}
}

/// A kind of cell: [`Vertex`], [`Edge`], [`Face`] or [`Volume`].
pub trait Kind: sealed::Sealed + 'static {
    /// 0 for a vertex to 3 for a volume.
    const DIMENSION: usize;
    /// What a cell of this kind is called.
    const NAME: &'static str;
}

macro_rules! kinds {
    ($($kind:ident, $dimension:literal, $name:literal, $meaning:literal;)*) => {$(
        #[doc = $meaning]
        #[derive(Clone, Copy, Debug)]
        pub enum $kind {}
        impl sealed::Sealed for $kind {}
        impl Kind for $kind {
            const DIMENSION: usize = $dimension;
            const NAME: &'static str = $name;
        }
    )*};
}

kinds! {
    Vertex, 0, "vertex", "A cell of dimension 0: the darts that leave a point.";
    Edge, 1, "edge", "A cell of dimension 1: the darts between two points, of every face around.";
    Face, 2, "face", "A cell of dimension 2: a ring of darts, and the ring on its other side if it has one.";
    Volume, 3, "volume", "A cell of dimension 3: the darts of a closed surface. In a 2-map, of a whole component.";
}

/// A `K`-cell: `Cell<Vertex>` and `Cell<Face>` do not mix. Valid in the map that gave it, while the cell lives.
///
/// Its index may be taken by another cell after that. An id that leaves the process must therefore be an [`Id`].
pub struct Cell<K> {
    index: u32,
    kind: PhantomData<fn() -> K>,
}

impl<K> Cell<K> {
    pub(crate) const fn new(index: u32) -> Self {
        let kind = PhantomData;
        Self { index, kind }
    }

    /// The cell's row in columns of its kind.
    pub fn index(self) -> usize {
        self.index as usize
    }

    pub(crate) const fn label(self) -> u32 {
        self.index
    }
}

impl<K> Clone for Cell<K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K> Copy for Cell<K> {}

impl<K> PartialEq for Cell<K> {
    fn eq(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

impl<K> Eq for Cell<K> {}

impl<K> PartialOrd for Cell<K> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<K> Ord for Cell<K> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.index.cmp(&other.index)
    }
}

impl<K> Hash for Cell<K> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.index.hash(state);
    }
}

impl<K: Kind> fmt::Debug for Cell<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", K::NAME, self.index)
    }
}

impl<K: Kind> fmt::Display for Cell<K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// A cell's id outside the process: the slot, and how often the slot was given up before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id {
    /// Row in columns of the cell's kind.
    pub slot: u32,
    /// 0 for the first cell in the slot.
    pub generation: u32,
}

/// A cell of any kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AnyCell {
    /// A vertex.
    Vertex(Cell<Vertex>),
    /// An edge.
    Edge(Cell<Edge>),
    /// A face.
    Face(Cell<Face>),
    /// A volume.
    Volume(Cell<Volume>),
}

impl AnyCell {
    pub(crate) fn of(dimension: usize, label: u32) -> Self {
        match dimension {
            0 => Self::Vertex(Cell::new(label)),
            1 => Self::Edge(Cell::new(label)),
            2 => Self::Face(Cell::new(label)),
            _ => Self::Volume(Cell::new(label)),
        }
    }
}

impl fmt::Display for AnyCell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertex(cell) => cell.fmt(f),
            Self::Edge(cell) => cell.fmt(f),
            Self::Face(cell) => cell.fmt(f),
            Self::Volume(cell) => cell.fmt(f),
        }
    }
}
