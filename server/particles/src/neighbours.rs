//! Which particles are near which: exact, in n log n, wherever the particles are.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::rows::{Block, Rows, block_of, is_shared};

/// Cells from the middle to either side; whoever is farther out shares the outermost, which costs time and nothing else.
const CELLS: f64 = (1 << 20) as f64;

/// Pairs within reach, kept until a particle has moved by half the skin.
///
/// Rows are in the order of `order`: along a curve through the cells, so that what is near in space is near in memory
/// whatever the order of the particles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    /// The particle at each place.
    pub(crate) order: Vec<u32>,
    /// Pairs of each class.
    pub(crate) rows: [Rows<u32>; 2],
    /// Where the particles were when the pairs were found, m.
    reference: Vec<Vector3<f64>>,
}

/// What pairs are searched for.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    /// Distance within which a pair of each class acts, m; 0 for a class that is not searched for.
    pub(crate) reach: [f64; 2],
    /// What particles may move before the next search, twice, m.
    pub(crate) skin: f64,
}

/// More pairs than memory should hold: too many particles within reach of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Crowded;

/// Pairs that a particle may have on average.
const CROWD: usize = 2_000;

impl Neighbours {
    /// Finds the pairs anew if a particle has moved too far; `class` says of what class a pair is.
    pub(crate) fn update(
        &mut self,
        search: &Search,
        position: &[Vector3<f64>],
        class: impl Fn(u32, u32) -> Option<usize> + Sync,
    ) -> Result<(), Crowded> {
        let far = (0.5 * search.skin).powi(2);
        let moved =
            |(x, reference): (&Vector3<f64>, &Vector3<f64>)| (x - reference).norm_squared() > far;
        if self.reference.len() == position.len()
            && !position.iter().zip(&self.reference).any(moved)
        {
            return Ok(());
        }
        self.reference.clear();
        let width = search.reach[0].max(search.reach[1]) + search.skin;
        let (keys, order) = sorted(position, width);
        let places: Vec<_> = order.iter().map(|&i| position[i as usize]).collect();
        let finder = Finder {
            squares: search.reach.map(|reach| {
                let within = if reach > 0.0 {
                    reach + search.skin
                } else {
                    0.0
                };
                within * within
            }),
            cells: cells(&keys),
            order: &order,
            places: &places,
        };
        finder.fill(&mut self.rows, &class)?;
        self.order = order;
        self.reference.extend_from_slice(position);
        Ok(())
    }
}

/// The cells' keys and the particles in the order of their cells.
fn sorted(position: &[Vector3<f64>], width: f64) -> (Vec<u64>, Vec<u32>) {
    let middle = Vector3::from_fn(|axis, _| median(position.iter().map(|x| x[axis]).collect()));
    let cell = |x: &Vector3<f64>| {
        let at = ((x - middle) / width).map(|c| c.floor().clamp(-CELLS, CELLS - 1.0) + CELLS);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to 21 bits; no number becomes 0"
        )]
        let [a, b, c] = [at.x as u64, at.y as u64, at.z as u64];
        spread(a) | spread(b) << 1 | spread(c) << 2
    };
    let mut keyed: Vec<(u64, u32)> = position.iter().map(cell).zip(0..).collect();
    if is_shared(keyed.len()) {
        keyed.par_sort_unstable();
    } else {
        keyed.sort_unstable();
    }
    keyed.into_iter().unzip()
}

/// One particle infinitely far moves a median by next to nothing, a mean or a box by as much as it likes.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

/// Bit k moves to bit 3 k: Morton's order.
fn spread(bits: u64) -> u64 {
    let mut x = bits;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Every third bit, from the lowest on: the inverse of [`spread`].
fn gathered(bits: u64) -> u64 {
    let mut x = bits & 0x1249_2492_4924_9249;
    for (shift, mask) in [
        (2, 0x10c3_0c30_c30c_30c3),
        (4, 0x100f_00f0_0f00_f00f),
        (8, 0x001f_0000_ff00_00ff),
        (16, 0x001f_0000_0000_ffff),
        (32, 0x001f_ffff),
    ] {
        x = (x | x >> shift) & mask;
    }
    x
}

/// The cells that hold particles: their keys, ascending, and their particles' places.
fn cells(keys: &[u64]) -> Vec<(u64, Range<usize>)> {
    let mut start = 0;
    let chunks = keys.chunk_by(|a, b| a == b);
    chunks
        .map(|cell| {
            let places = start..start + cell.len();
            start = places.end;
            (cell[0], places)
        })
        .collect()
}

struct Finder<'a> {
    squares: [f64; 2], // m²
    cells: Vec<(u64, Range<usize>)>,
    order: &'a [u32],
    places: &'a [Vector3<f64>],
}

impl Finder<'_> {
    /// Finds the rows of both classes, in the memory of those before; none at all where there are too many pairs.
    fn fill(
        &self,
        rows: &mut [Rows<u32>; 2],
        class: &(impl Fn(u32, u32) -> Option<usize> + Sync),
    ) -> Result<(), Crowded> {
        let places = self.places.len();
        let size = block_of(places);
        let [first, second] = rows.each_mut().map(|rows| rows.blocks_of(places));
        let range = |block: usize| block * size..places.min((block + 1) * size);
        let found = if is_shared(places) {
            (first.par_iter_mut().zip(second).enumerate())
                .try_for_each(|(i, (a, b))| self.block(range(i), [a, b], class))
        } else {
            let mut blocks = first.iter_mut().zip(second).enumerate();
            blocks.try_for_each(|(i, (a, b))| self.block(range(i), [a, b], class))
        };
        if found.is_err() {
            *rows = Default::default();
        }
        found
    }

    /// Finds the rows of a block of places.
    fn block(
        &self,
        block: Range<usize>,
        mut found: [&mut Block<u32>; 2],
        class: &impl Fn(u32, u32) -> Option<usize>,
    ) -> Result<(), Crowded> {
        let most = CROWD * block_of(self.places.len());
        let mut near = Vec::new();
        let first = self
            .cells
            .partition_point(|(_, places)| places.end <= block.start);
        for (key, places) in &self.cells[first..] {
            if places.start >= block.end {
                break;
            }
            let around = self.around(*key);
            near.resize(around.iter().map(Range::len).sum(), 0);
            for a in places.start.max(block.start)..places.end.min(block.end) {
                let mut count = 0;
                for cell in &around {
                    // A pair within the block stands in the row of its first end alone.
                    let outside = cell.start..cell.end.min(block.start);
                    count += self.pick(a, outside, &mut near[count..]);
                    count += self.pick(a, cell.start.max(a + 1)..cell.end, &mut near[count..]);
                }
                for (of_class, found) in found.iter_mut().enumerate() {
                    let near = near[..count].iter().copied();
                    found.push_row(near.filter(|&b| self.is_kept(a, b, of_class, class)));
                    if found.len() > most {
                        return Err(Crowded);
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes those of some places that are near enough for one class or the other, and returns how many these are.
    ///
    /// Without a branch, which no processor would foresee: each place is written, and counted if it is near.
    #[inline]
    fn pick(&self, a: usize, places: Range<usize>, near: &mut [u32]) -> usize {
        if places.is_empty() {
            return 0;
        }
        let square = self.widest();
        let at = self.places[a];
        let first = u32::try_from(places.start).expect("particles are counted in 32 bits");
        let mut count = 0;
        for (b, place) in (first..).zip(&self.places[places]) {
            near[count] = b;
            count += usize::from((place - at).norm_squared() < square);
        }
        count
    }

    fn widest(&self) -> f64 {
        self.squares[0].max(self.squares[1])
    }

    /// Whether the row of a place has another, which is near enough for one class or the other, in a class.
    #[inline]
    fn is_kept(
        &self,
        a: usize,
        b: u32,
        of_class: usize,
        class: &impl Fn(u32, u32) -> Option<usize>,
    ) -> bool {
        let b = b as usize;
        let square = self.squares[of_class];
        let is_near = || (self.places[b] - self.places[a]).norm_squared() < square;
        class(self.order[a], self.order[b]) == Some(of_class)
            && (square == self.widest() || is_near())
    }

    /// The places in a cell and in the 26 around it.
    fn around(&self, key: u64) -> Vec<Range<usize>> {
        let at = [0, 1, 2].map(|axis| gathered(key >> axis));
        let beside = |c: u64| {
            [
                c.checked_sub(1),
                Some(c),
                Some(c + 1).filter(|&c| c < 1 << 21),
            ]
        };
        let mut around = Vec::with_capacity(27);
        for x in beside(at[0]).into_iter().flatten() {
            for y in beside(at[1]).into_iter().flatten() {
                for z in beside(at[2]).into_iter().flatten() {
                    let key = spread(x) | spread(y) << 1 | spread(z) << 2;
                    if let Ok(cell) = self.cells.binary_search_by_key(&key, |(key, _)| *key) {
                        around.push(self.cells[cell].1.clone());
                    }
                }
            }
        }
        around
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn spread_and_gathered_undo_each_other() {
        for bits in [0, 1, 2, 0x15_5555, 0x1f_ffff, 0x10_0001] {
            assert_eq!(gathered(spread(bits)), bits);
            assert_eq!(gathered(spread(bits) << 1), 0);
        }
    }

    /// The pairs of a class, by particles, in order.
    fn pairs(neighbours: &Neighbours, class: usize) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        neighbours.rows[class].for_each_end(|a, b, _| {
            let ends = [neighbours.order[a], neighbours.order[b]];
            if ends[0] < ends[1] {
                pairs.push(ends);
            }
        });
        pairs.sort_unstable();
        pairs
    }

    proptest! {
        #[test]
        fn no_pair_is_missed_and_none_is_found_twice(
            places in prop::collection::vec(prop::array::uniform3(-3.0..3.0), 0..200),
            outliers in prop::collection::vec(prop::array::uniform3(-1e300..1e300), 0..3),
            reach in 0.1..2.0f64,
        ) {
            let places: Vec<Vector3<f64>> =
                places.into_iter().chain(outliers).map(Vector3::from).collect();
            let search = Search { reach: [reach, 0.5 * reach], skin: 0.0 };
            let class = |a: u32, b: u32| Some(((a + b) % 2) as usize);
            let mut neighbours = Neighbours::default();
            neighbours.update(&search, &places, class).unwrap();
            for of_class in [0, 1] {
                let mut expected = Vec::new();
                for b in 0..places.len() {
                    for a in 0..b {
                        let ends = [a, b].map(|i| u32::try_from(i).unwrap());
                        let within = (places[b] - places[a]).norm_squared() < search.reach[of_class].powi(2);
                        if within && class(ends[0], ends[1]) == Some(of_class) {
                            expected.push(ends);
                        }
                    }
                }
                expected.sort_unstable();
                prop_assert_eq!(pairs(&neighbours, of_class), expected);
            }
        }
    }

    #[test]
    fn a_cluster_and_one_particle_infinitely_far_take_no_quadratic_time() {
        let side = 30;
        let at = |i: i32| f64::from(i);
        let mut places: Vec<_> = (0..side * side * side)
            .map(|i| Vector3::new(at(i % side), at(i / side % side), at(i / side / side)))
            .collect();
        places.push(Vector3::repeat(1e300));
        let search = Search {
            reach: [1.1, 0.0],
            skin: 0.1,
        };
        let mut neighbours = Neighbours::default();
        neighbours.update(&search, &places, |_, _| Some(0)).unwrap();
        let side = side as usize;
        assert_eq!(pairs(&neighbours, 0).len(), 3 * side * side * (side - 1));
        let fullest = cells(&sorted(&places, 1.2).0)
            .into_iter()
            .map(|(_, places)| places.len());
        assert!(fullest.max().unwrap() <= 8);
    }

    #[test]
    fn pairs_are_kept_until_a_particle_has_moved_by_half_the_skin() {
        let search = Search {
            reach: [1.0, 0.0],
            skin: 0.2,
        };
        let mut neighbours = Neighbours::default();
        let at = |x: f64| vec![Vector3::zeros(), Vector3::new(x, 0.0, 0.0)];
        neighbours
            .update(&search, &at(1.3), |_, _| Some(0))
            .unwrap();
        assert_eq!(pairs(&neighbours, 0), [] as [[u32; 2]; 0]);
        neighbours
            .update(&search, &at(1.21), |_, _| Some(0))
            .unwrap();
        assert_eq!(neighbours.reference, at(1.3));
        neighbours
            .update(&search, &at(1.19), |_, _| Some(0))
            .unwrap();
        assert_eq!(pairs(&neighbours, 0), [[0, 1]]);
    }

    #[test]
    fn a_crowd_is_refused_before_it_fills_the_memory() {
        let search = Search {
            reach: [1.0, 0.0],
            skin: 0.0,
        };
        let crowd = vec![Vector3::zeros(); 8_000];
        let refused = Neighbours::default().update(&search, &crowd, |_, _| Some(0));
        assert_eq!(refused, Err(Crowded));
    }
}
