//! The map: darts, their involutions, and which cells they belong to.

use xxhash_rust::xxh3::Xxh3;

use crate::journal::Journal;
use crate::orbit::Walk;
use crate::slots::{NONE, Reuse, Slots, UNSETTLED};
use crate::{Cell, Dart, Edge, Face, Id, Kind, Vertex, Volume};

/// How many dimensions a map has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// Surfaces. β3 is free everywhere; β2 is free along a surface's border. A "volume" is a connected component, so that
    /// edits that may join or part components look at all of them.
    Two,
    /// Volumes. β3 is free on the boundary; β2 is free nowhere: every volume's surface is closed.
    Three,
}

/// Labels per dart.
pub(crate) const VERTEX: usize = 0;
pub(crate) const EDGE: usize = 1;
/// Twice the face, plus 1 on its second side.
pub(crate) const SIDE: usize = 2;

/// An oriented combinatorial map of dimension 2 or 3, and its cells.
///
/// A dart leaves its vertex along its edge, in a face, on the side of a volume:
///
/// * β1 is the next dart around the face. β0, its inverse, is found by walking around.
/// * β2 is the dart of the same edge in the next face of the same volume, in the other direction.
/// * β3 is the dart of the same edge and face on the side of the next volume, in the other direction.
///
/// A face's darts wind counter-clockwise as seen from outside their volume. A boundary has no darts of its own: there
/// β3 is `None` (in a 2-map, β2).
///
/// # Cells
///
/// A cell has an index, a row in columns of its kind ([`crate::Column`]). Indices start as the mesh numbers its vertices
/// and volumes, and edges and faces in the order of their first dart. An edit gives a new cell the slot that was given
/// up last, but the slots of *vertices* are appended only, until [`Map::reclaim`]: whoever follows the edits from
/// outside may keep its vertex numbers until it is told otherwise. A slot counts how often it was given up; [`Map::id`]
/// adds that count, and [`Map::find`] refuses an id whose cell is dead.
#[derive(Clone, Debug)]
pub struct Map {
    pub(crate) dimension: Dimension,
    /// β1, β2, β3.
    pub(crate) beta: [Vec<Option<Dart>>; 3],
    pub(crate) label: [Vec<u32>; 3],
    /// Of each side of each face; [`NONE`] if there is no volume.
    pub(crate) side_volume: Vec<u32>,
    /// By dimension.
    pub(crate) slots: [Slots; 4],
    pub(crate) free_darts: Vec<Dart>,
    pub(crate) journal: Journal,
    /// For the searches of edits.
    pub(crate) walk: Walk,
    pub(crate) second_walk: Walk,
}

impl Map {
    /// A map without darts.
    pub fn new(dimension: Dimension) -> Self {
        Self {
            dimension,
            beta: Default::default(),
            label: Default::default(),
            side_volume: Vec::new(),
            slots: [
                Slots::new(Reuse::WhenReclaimed),
                Slots::new(Reuse::AtOnce),
                Slots::new(Reuse::AtOnce),
                Slots::new(Reuse::AtOnce),
            ],
            free_darts: Vec::new(),
            journal: Journal::default(),
            walk: Walk::default(),
            second_walk: Walk::default(),
        }
    }

    /// How many dimensions the map has.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The next dart around the face.
    ///
    /// # Panics
    /// As the other β, if the dart is not one of this map's. Within an edit also where the face is open.
    pub fn beta1(&self, dart: Dart) -> Dart {
        self.beta[0][dart.index()].expect("faces are closed outside edits")
    }

    /// The dart of the same edge in the next face of the same volume, or `None` on the border of a 2-map.
    pub fn beta2(&self, dart: Dart) -> Option<Dart> {
        self.beta[1][dart.index()]
    }

    /// The dart of the same edge and face in the next volume, or `None` on the boundary.
    pub fn beta3(&self, dart: Dart) -> Option<Dart> {
        self.beta[2][dart.index()]
    }

    /// The dart before, around the face. Costs a walk around the face.
    ///
    /// # Panics
    /// As [`Map::beta1`].
    pub fn beta0(&self, dart: Dart) -> Dart {
        let mut before = dart;
        loop {
            let next = self.beta1(before);
            if next == dart {
                return before;
            }
            before = next;
        }
    }

    /// The `K`-cell that a dart belongs to: the vertex that it leaves, its edge, face or volume.
    ///
    /// # Panics
    /// If the dart is not one of this map's.
    pub fn cell<K: Kind>(&self, dart: Dart) -> Cell<K> {
        let label = self.label_of::<K>(dart);
        debug_assert_ne!(label, NONE, "{dart} has no {} yet", K::NAME);
        Cell::new(label)
    }

    /// [`Map::cell`], or [`NONE`].
    pub(crate) fn label_of<K: Kind>(&self, dart: Dart) -> u32 {
        self.label_in(K::DIMENSION, dart)
    }

    pub(crate) fn label_in(&self, dimension: usize, dart: Dart) -> u32 {
        let dart = dart.index();
        match dimension {
            0 | 1 => self.label[dimension][dart],
            _ => match self.label[SIDE][dart] {
                NONE | UNSETTLED => NONE,
                side if dimension == 2 => side / 2,
                side => self.side_volume[side as usize],
            },
        }
    }

    /// The vertex that a dart leaves.
    ///
    /// # Panics
    /// As [`Map::cell`].
    pub fn vertex(&self, dart: Dart) -> Cell<Vertex> {
        self.cell(dart)
    }

    /// The edge that a dart runs along.
    ///
    /// # Panics
    /// As [`Map::cell`].
    pub fn edge(&self, dart: Dart) -> Cell<Edge> {
        self.cell(dart)
    }

    /// The face that a dart winds around.
    ///
    /// # Panics
    /// As [`Map::cell`].
    pub fn face(&self, dart: Dart) -> Cell<Face> {
        self.cell(dart)
    }

    /// The volume on whose side a dart is.
    ///
    /// # Panics
    /// As [`Map::cell`].
    pub fn volume(&self, dart: Dart) -> Cell<Volume> {
        self.cell(dart)
    }

    /// One dart of a cell; the same until an edit changes the cell. Of an edge on the boundary, one whose β3 is free.
    ///
    /// # Panics
    /// If the cell is dead.
    pub fn dart<K: Kind>(&self, cell: Cell<K>) -> Dart {
        self.try_dart(cell).expect("the cell is alive")
    }

    /// One dart of a cell, or `None` if it is dead.
    pub fn try_dart<K: Kind>(&self, cell: Cell<K>) -> Option<Dart> {
        *self.slots[K::DIMENSION].dart.get(cell.index())?
    }

    /// The dart in row `index`, if there is one.
    pub fn dart_at(&self, index: usize) -> Option<Dart> {
        let is_live = |side: &&u32| **side != NONE;
        self.label[SIDE].get(index).filter(is_live)?;
        Some(Dart::at(index))
    }

    /// The cell in slot `index`, if there is one.
    pub fn cell_at<K: Kind>(&self, index: usize) -> Option<Cell<K>> {
        (*self.slots[K::DIMENSION].dart.get(index)?)?;
        Some(Cell::new(u32::try_from(index).ok()?))
    }

    /// All darts, by ascending index.
    pub fn darts(&self) -> impl Iterator<Item = Dart> + '_ {
        let labels = self.label[SIDE].iter().enumerate();
        let live = labels.filter(|&(_, &side)| side != NONE);
        live.map(|(index, _)| Dart::at(index))
    }

    /// All cells of a kind, by ascending index.
    pub fn cells<K: Kind>(&self) -> impl Iterator<Item = Cell<K>> + '_ {
        let darts = (0u32..).zip(&self.slots[K::DIMENSION].dart);
        darts
            .filter(|(_, dart)| dart.is_some())
            .map(|(index, _)| Cell::new(index))
    }

    /// How many darts there are.
    pub fn dart_count(&self) -> usize {
        self.label[SIDE].len() - self.free_darts.len()
    }

    /// How many cells of a kind there are.
    pub fn count<K: Kind>(&self) -> usize {
        self.slots[K::DIMENSION].live()
    }

    /// How many slots for cells of a kind there are: the length that columns have.
    pub fn slot_count<K: Kind>(&self) -> usize {
        self.slots[K::DIMENSION].dart.len()
    }

    /// How many rows for darts there are, free ones included.
    pub fn dart_slot_count(&self) -> usize {
        self.beta[0].len()
    }

    /// A cell's id for use outside the process.
    pub fn id<K: Kind>(&self, cell: Cell<K>) -> Id {
        let slot = cell.label();
        let generation = self.slots[K::DIMENSION].generation(slot);
        Id { slot, generation }
    }

    /// The cell with this id, unless it is dead.
    pub fn find<K: Kind>(&self, id: Id) -> Option<Cell<K>> {
        let cell = self.cell_at(id.slot as usize)?;
        (self.id(cell) == id).then_some(cell)
    }

    /// The volumes on the two sides of a face: of [`Map::dart`], and beyond.
    ///
    /// # Panics
    /// If the face is dead.
    pub fn volumes_of(&self, face: Cell<Face>) -> (Cell<Volume>, Option<Cell<Volume>>) {
        let dart = self.dart(face);
        let beyond = self.beta3(dart).map(|other| self.volume(other));
        (self.volume(dart), beyond)
    }

    /// The two vertices of an edge, along its [`Map::dart`].
    ///
    /// # Panics
    /// If the edge is dead.
    pub fn ends(&self, edge: Cell<Edge>) -> [Cell<Vertex>; 2] {
        let dart = self.dart(edge);
        [self.vertex(dart), self.vertex(self.beta1(dart))]
    }

    /// The vertex that a dart runs to.
    ///
    /// # Panics
    /// As [`Map::cell`].
    pub fn head(&self, dart: Dart) -> Cell<Vertex> {
        self.vertex(self.beta1(dart))
    }

    /// Lets the slots of dead vertices be taken again, for instance when everybody gets the whole mesh anew.
    pub fn reclaim(&mut self) {
        for slots in &mut self.slots {
            slots.free.append(&mut slots.retired);
        }
    }

    /// Bytes that the map's columns hold, of which cells take a part.
    pub fn bytes(&self) -> usize {
        let betas: usize = self.beta.iter().map(Vec::capacity).sum();
        let labels: usize = self.label.iter().map(Vec::capacity).sum();
        let slots: usize = self.slots.iter().map(Slots::bytes).sum();
        let others = self.side_volume.capacity() + self.free_darts.capacity();
        4 * (betas + labels + others)
            + slots
            + self.walk.bytes()
            + self.second_walk.bytes()
            + self.journal.bytes()
    }

    /// A number that two maps share only if they are the same dart by dart and cell by cell, dead ones and generations
    /// included (up to the odds of a 64-bit hash).
    pub fn digest(&self) -> u64 {
        let mut hasher = Xxh3::new();
        for column in &self.beta {
            hash(&mut hasher, column.iter().map(number));
        }
        for column in &self.label {
            hash(&mut hasher, column.iter().copied());
        }
        hash(&mut hasher, self.side_volume.iter().copied());
        for slots in &self.slots {
            hash(&mut hasher, slots.dart.iter().map(number));
            hash(&mut hasher, slots.free.iter().copied());
            hash(&mut hasher, slots.retired.iter().copied());
            hash(&mut hasher, slots.generation.iter().copied());
        }
        hash(
            &mut hasher,
            self.free_darts.iter().map(|d| number(&Some(*d))),
        );
        hasher.digest()
    }

    /// As [`Map::digest`], but of the darts and the partition into cells only: what the cells are called does not count.
    pub fn structure_digest(&self) -> u64 {
        let mut hasher = Xxh3::new();
        for column in &self.beta {
            hash(&mut hasher, column.iter().map(number));
        }
        for dimension in 0..4 {
            // Cells by the order in which their first darts come.
            let mut names = vec![NONE; self.slots[dimension].dart.len()];
            let mut count = 0;
            let renamed = self.darts().map(|dart| {
                let name = &mut names[self.label_in(dimension, dart) as usize];
                if *name == NONE {
                    *name = count;
                    count += 1;
                }
                *name
            });
            hash(&mut hasher, renamed);
        }
        hasher.digest()
    }
}

fn number(dart: &Option<Dart>) -> u32 {
    dart.map_or(NONE, |dart| {
        u32::try_from(dart.index()).expect("below Dart::MOST")
    })
}

fn hash(hasher: &mut Xxh3, mut numbers: impl Iterator<Item = u32>) {
    let mut length = 0u64;
    let mut bytes = [0; 4096];
    loop {
        let mut filled = 0;
        for (to, number) in bytes.chunks_exact_mut(4).zip(&mut numbers) {
            to.copy_from_slice(&number.to_le_bytes());
            filled += 4;
        }
        hasher.update(&bytes[..filled]);
        length += filled as u64;
        if filled < bytes.len() {
            break;
        }
    }
    hasher.update(&length.to_le_bytes());
}
