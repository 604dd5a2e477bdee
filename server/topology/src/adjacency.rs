//! Incidence and adjacency of all cells at once, as flat rows.

use std::marker::PhantomData;

use crate::orbit::LabelSet;
use crate::slots::NONE;
use crate::{Cell, Changes, Kind, Map, Walk};

/// Rows of cells in one array. A row that has outgrown its place is moved to the end.
#[derive(Clone, Debug)]
struct Rows<T: Kind> {
    /// Where each row starts, and its length.
    spans: Vec<(u32, u32)>,
    cells: Vec<Cell<T>>,
    /// Entries of `cells` in no row.
    unused: usize,
}

impl<T: Kind> Default for Rows<T> {
    fn default() -> Self {
        Self {
            spans: Vec::new(),
            cells: Vec::new(),
            unused: 0,
        }
    }
}

impl<T: Kind> Rows<T> {
    fn row(&self, index: usize) -> &[Cell<T>] {
        match self.spans.get(index) {
            None => &[],
            Some(&(start, length)) => &self.cells[start as usize..(start + length) as usize],
        }
    }

    fn push(&mut self, row: &[u32]) {
        let span = (number(self.cells.len()), number(row.len()));
        self.cells.extend(row.iter().map(|&label| Cell::new(label)));
        self.spans.push(span);
    }

    fn replace(&mut self, index: usize, row: &[u32]) {
        if self.spans.len() <= index {
            self.spans.resize(index + 1, (0, 0));
        }
        let (start, length) = self.spans[index];
        if row.len() <= length as usize {
            self.unused += length as usize - row.len();
            self.spans[index].1 = number(row.len());
            let place = &mut self.cells[start as usize..][..row.len()];
            for (to, &label) in place.iter_mut().zip(row) {
                *to = Cell::new(label);
            }
        } else {
            self.unused += length as usize;
            self.spans[index] = (number(self.cells.len()), number(row.len()));
            self.cells.extend(row.iter().map(|&label| Cell::new(label)));
        }
    }

    /// Moves the rows together once more than half of the array is unused.
    fn tidy(&mut self) {
        if 2 * self.unused <= self.cells.len() {
            return;
        }
        let mut cells = Vec::with_capacity(self.cells.len() - self.unused);
        for (start, length) in &mut self.spans {
            let from = *start as usize;
            *start = number(cells.len());
            cells.extend_from_slice(&self.cells[from..from + *length as usize]);
        }
        self.cells = cells;
        self.unused = 0;
    }
}

fn number(index: usize) -> u32 {
    u32::try_from(index).expect("fewer than u32::MAX entries")
}

/// Of each `I`-cell, the `J`-cells incident to it, ascending.
#[derive(Clone, Debug)]
pub struct Incidence<I, J: Kind> {
    rows: Rows<J>,
    walk: Walk,
    kind: PhantomData<fn() -> I>,
}

impl<I: Kind, J: Kind> Incidence<I, J> {
    /// Takes down the whole map. Linear.
    pub fn new(map: &Map) -> Self {
        let rows = if I::DIMENSION > J::DIMENSION {
            boundaries::<J>(map, I::DIMENSION)
        } else {
            let below = boundaries::<I>(map, J::DIMENSION);
            transpose(&below, map.slot_count::<I>())
        };
        let (walk, kind) = (Walk::default(), PhantomData);
        Self { rows, walk, kind }
    }

    /// The cells incident to `cell`, ascending; none for a dead one.
    pub fn of(&self, cell: Cell<I>) -> &[Cell<J>] {
        self.rows.row(cell.index())
    }

    /// Follows an edit; `map` is the map as that edit left it. Costs what the edit touched.
    pub fn follow(&mut self, map: &Map, changes: &Changes) {
        let mut row = Vec::new();
        // A row changes only where a dart of its cell did, or was taken from it.
        for cell in changes.touched::<I>(map) {
            row.clear();
            if map.try_dart(cell).is_some() {
                let now = map.incident::<I, J>(cell, &mut self.walk);
                row.extend(now.map(|cell| cell.label()));
            }
            row.sort_unstable();
            self.rows.replace(cell.index(), &row);
        }
        self.rows.tidy();
    }

    /// Of each row, where it starts in [`Incidence::entries`], and its length.
    pub fn spans(&self) -> &[(u32, u32)] {
        &self.rows.spans
    }

    /// The rows; entries between them belong to none.
    pub fn entries(&self) -> &[Cell<J>] {
        &self.rows.cells
    }
}

/// Of each `I`-cell, the other `I`-cells with which it has a `J`-cell in common, ascending: the graph whose nodes are the
/// `I`-cells and whose arcs are the `J`-cells.
#[derive(Clone, Debug)]
pub struct Adjacency<I: Kind, J> {
    rows: Rows<I>,
    walk: Walk,
    through: PhantomData<fn() -> J>,
}

impl<I: Kind, J: Kind> Adjacency<I, J> {
    /// Takes down the whole map. Linear.
    pub fn new(map: &Map) -> Self {
        let rows = match (I::DIMENSION, J::DIMENSION) {
            (0, 1) => {
                let edges = map.slots[1].dart.iter().flatten();
                let ends = |dart| [dart, map.beta1(dart)].map(|dart| map.vertex(dart).label());
                from_pairs(map.slot_count::<I>(), || {
                    edges.clone().map(|&dart| ends(dart))
                })
            }
            (3, 2) => {
                let (sides, _) = map.side_volume.as_chunks::<2>();
                from_pairs(map.slot_count::<I>(), || sides.iter().copied())
            }
            _ => Self::in_general(map),
        };
        let (walk, through) = (Walk::default(), PhantomData);
        Self {
            rows,
            walk,
            through,
        }
    }

    fn in_general(map: &Map) -> Rows<I> {
        let (there, back);
        if I::DIMENSION > J::DIMENSION {
            there = boundaries::<J>(map, I::DIMENSION);
            back = transpose::<I, J>(&there, map.slot_count::<J>());
        } else {
            back = boundaries::<I>(map, J::DIMENSION);
            there = transpose::<J, I>(&back, map.slot_count::<I>());
        }
        let mut rows = Rows::default();
        rows.spans.reserve_exact(there.spans.len());
        let mut found = LabelSet::default();
        for index in 0..there.spans.len() {
            found.restart(map.slot_count::<I>());
            for between in there.row(index) {
                for cell in back.row(between.index()) {
                    if cell.index() != index {
                        found.insert(cell.label());
                    }
                }
            }
            found.labels.sort_unstable();
            rows.push(&found.labels);
        }
        rows.cells.shrink_to_fit();
        rows
    }

    /// The cells adjacent to `cell`, ascending; none for a dead one.
    pub fn of(&self, cell: Cell<I>) -> &[Cell<I>] {
        self.rows.row(cell.index())
    }

    /// Follows an edit; `map` is the map as that edit left it. Costs what the edit touched and what is adjacent to that.
    pub fn follow(&mut self, map: &Map, changes: &Changes) {
        self.refresh(map, &changes.touched::<I>(map));
    }

    /// Takes down these cells, of which any may be dead now, and what is or was adjacent to them, as the map has them now.
    pub fn refresh(&mut self, map: &Map, touched: &[Cell<I>]) {
        // Two cells begin or end to be adjacent only where one of them is touched.
        let mut stale: Vec<_> = touched.iter().map(|cell| cell.label()).collect();
        for &cell in touched {
            stale.extend(self.of(cell).iter().map(|cell| cell.label()));
            if map.try_dart(cell).is_some() {
                let now = map.adjacent::<I, J>(cell, &mut self.walk);
                stale.extend(now.map(|cell| cell.label()));
            }
        }
        stale.sort_unstable();
        stale.dedup();
        let mut row = Vec::new();
        for label in stale {
            let cell = Cell::new(label);
            row.clear();
            if map.try_dart::<I>(cell).is_some() {
                let now = map.adjacent::<I, J>(cell, &mut self.walk);
                row.extend(now.map(|cell| cell.label()));
            }
            row.sort_unstable();
            self.rows.replace(cell.index(), &row);
        }
        self.rows.tidy();
    }

    /// Of each row, where it starts in [`Adjacency::entries`], and its length.
    pub fn spans(&self) -> &[(u32, u32)] {
        &self.rows.spans
    }

    /// The rows; entries between them belong to none.
    pub fn entries(&self) -> &[Cell<I>] {
        &self.rows.cells
    }
}

/// The rows of `length` cells of which no more than two meet in anything between them: here, which. Not cells that meet
/// themselves or, [`NONE`], nothing.
fn from_pairs<I: Kind, P: Iterator<Item = [u32; 2]>>(
    length: usize,
    pairs: impl Fn() -> P,
) -> Rows<I> {
    let pairs = || pairs().filter(|&[one, other]| one != other && one.max(other) != NONE);
    let mut spans = vec![(0, 0); length];
    for [one, other] in pairs() {
        spans[one as usize].1 += 1;
        spans[other as usize].1 += 1;
    }
    let mut end = 0;
    for (start, length) in &mut spans {
        *start = end;
        end += std::mem::take(length);
    }
    let mut cells = vec![Cell::new(0); end as usize];
    for [one, other] in pairs() {
        for (from, to) in [(one, other), (other, one)] {
            let (start, length) = &mut spans[from as usize];
            cells[(*start + *length) as usize] = Cell::new(to);
            *length += 1;
        }
    }
    let mut unused = 0;
    for (start, length) in &mut spans {
        let row = &mut cells[*start as usize..(*start + *length) as usize];
        row.sort_unstable();
        // Two cells may have several between them.
        let mut kept = 0;
        for at in 0..row.len() {
            if at == 0 || row[at] != row[kept - 1] {
                row[kept] = row[at];
                kept += 1;
            }
        }
        unused += row.len() - kept;
        *length = number(kept);
    }
    Rows {
        spans,
        cells,
        unused,
    }
}

/// Of each cell of dimension `of`, the `J`-cells that bound it, ascending.
fn boundaries<J: Kind>(map: &Map, of: usize) -> Rows<J> {
    let mut rows = Rows::default();
    rows.spans.reserve_exact(map.slots[of].dart.len());
    let mut walk = Walk::default();
    let mut found = LabelSet::default();
    for dart in &map.slots[of].dart {
        found.restart(map.slot_count::<J>());
        if let Some(dart) = *dart {
            map.gather(of, dart, J::DIMENSION, &mut walk, &mut found);
        }
        found.labels.sort_unstable();
        rows.push(&found.labels);
    }
    rows.cells.shrink_to_fit();
    rows
}

/// Of each of `length` cells that stand in rows, the rows, ascending.
fn transpose<I: Kind, J: Kind>(rows: &Rows<J>, length: usize) -> Rows<I> {
    let mut spans = vec![(0, 0); length];
    for cell in &rows.cells {
        spans[cell.index()].1 += 1;
    }
    let mut start = 0;
    for span in &mut spans {
        (span.0, start) = (start, start + span.1);
        span.1 = 0;
    }
    let mut cells = vec![Cell::new(0); start as usize];
    for (index, _) in rows.spans.iter().enumerate() {
        let row = Cell::new(number(index));
        for cell in rows.row(index) {
            let (start, length) = &mut spans[cell.index()];
            cells[(*start + *length) as usize] = row;
            *length += 1;
        }
    }
    let unused = 0;
    Rows {
        spans,
        cells,
        unused,
    }
}
