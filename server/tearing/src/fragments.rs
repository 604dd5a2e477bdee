//! Fragments: what faces hold together.

use sinew_topology::{Adjacency, Dart, Face, Map, Volume};

use crate::body::number;
use crate::commit::Made;
use crate::ledger::Ledger;
use crate::{Body, Effect};

/// Which cells faces hold together.
#[derive(Clone, Debug)]
pub(crate) struct Fragments {
    /// By cell slot.
    of: Ledger<u32>,
    /// Cells of each fragment.
    sizes: Ledger<u32>,
    /// Scratch memory: by cell slot, the search that has met it. All [`NONE`] between searches.
    met: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Fragments {
    /// Those of a map whose volumes have their indices as slots.
    pub(crate) fn new(map: &Map) -> Self {
        let neighbours = Adjacency::<Volume, Face>::new(map);
        let mut of = vec![NONE; map.slot_count::<Volume>()];
        let mut sizes = Vec::new();
        let mut queue = Vec::new();
        for first in map.cells::<Volume>() {
            if of[first.index()] != NONE {
                continue;
            }
            let fragment = number(sizes.len());
            sizes.push(0);
            of[first.index()] = fragment;
            queue.push(first);
            while let Some(volume) = queue.pop() {
                sizes[fragment as usize] += 1;
                for &next in neighbours.of(volume) {
                    if of[next.index()] == NONE {
                        of[next.index()] = fragment;
                        queue.push(next);
                    }
                }
            }
        }
        let met = vec![NONE; of.len()];
        Self {
            of: Ledger::new(of),
            sizes: Ledger::new(sizes),
            met,
        }
    }

    pub(crate) fn of(&self, slot: u32) -> u32 {
        self.of[slot as usize]
    }

    pub(crate) fn sizes(&self) -> &[u32] {
        &self.sizes
    }

    /// A cell in the next slot: part of its parent's fragment, or for now a fragment of its own.
    pub(crate) fn born(&mut self, slot: u32, parent: Option<u32>) {
        debug_assert_eq!(slot as usize, self.of.len(), "slots are appended");
        let fragment = match parent {
            Some(parent) => self.of(parent),
            None => {
                self.sizes.push(0);
                number(self.sizes.len() - 1)
            }
        };
        self.of.push(fragment);
        self.met.push(NONE);
        self.grow(fragment, 1);
    }

    pub(crate) fn died(&mut self, slot: u32) {
        self.shrink(self.of(slot), 1);
    }

    fn grow(&mut self, fragment: u32, by: u32) {
        let size = self.sizes[fragment as usize];
        self.sizes.set(fragment as usize, size + by);
    }

    fn shrink(&mut self, fragment: u32, by: u32) {
        let size = self.sizes[fragment as usize];
        self.sizes.set(fragment as usize, size - by);
    }

    pub(crate) fn keep(&mut self) {
        self.of.keep();
        self.sizes.keep();
    }

    pub(crate) fn revert(&mut self) {
        self.of.revert();
        self.sizes.revert();
        self.met.truncate(self.of.len());
    }
}

/// Searches from several cells at once, one cell of each at a time, so that the whole costs no more than what comes off
/// times the number of searches left.
struct Search {
    /// What each has met; those of a search that met another are the other's.
    cells: Vec<Vec<u32>>,
    /// How many of these are done.
    done: Vec<usize>,
    /// The search that each has become part of; itself while it goes on.
    part_of: Vec<usize>,
}

impl Search {
    fn root(&self, mut search: usize) -> usize {
        while self.part_of[search] != search {
            search = self.part_of[search];
        }
        search
    }

    fn is_over(&self, search: usize) -> bool {
        self.done[search] == self.cells[search].len()
    }

    /// Makes one search of two.
    fn unite(&mut self, one: usize, other: usize) {
        let (keep, give) = if self.cells[one].len() < self.cells[other].len() {
            (other, one)
        } else {
            (one, other)
        };
        self.part_of[give] = keep;
        // What is done comes first, so that one count tells.
        let given = std::mem::take(&mut self.cells[give]);
        let (done, to_do) = given.split_at(self.done[give]);
        let first = self.done[keep];
        let kept = &mut self.cells[keep];
        let ahead = kept.len();
        kept.extend_from_slice(done);
        // Exchange as many of those to do for those done.
        for at in 0..done.len() {
            kept.swap(first + at, ahead + at);
        }
        kept.extend_from_slice(to_do);
        self.done[keep] += self.done[give];
    }
}

impl Body {
    /// Makes one fragment of those on the sides of faces that came together. The one with more cells lives on, the lower
    /// number of two alike.
    pub(crate) fn join_fragments(&mut self, closed: &[[Dart; 2]], effects: &mut Vec<Effect>) {
        for darts in closed {
            let slots = darts.map(|dart| self.slot(self.map.volume(dart)));
            let [one, other] = slots.map(|slot| self.fragments.of(slot));
            if one == other {
                continue;
            }
            let size = |fragment: u32| self.fragments.sizes[fragment as usize];
            let keeps = (size(one), other) > (size(other), one);
            let (fragment, absorbed, from) = if keeps {
                (one, other, slots[1])
            } else {
                (other, one, slots[0])
            };
            self.relabel(from, absorbed, fragment);
            effects.push(Effect::FragmentsJoined { fragment, absorbed });
        }
    }

    /// Gives the cells of `from`'s number that are connected to a cell another number.
    fn relabel(&mut self, first: u32, from: u32, to: u32) {
        let mut queue = vec![first];
        self.fragments.of.set(first as usize, to);
        let mut count = 0;
        while let Some(slot) = queue.pop() {
            count += 1;
            for next in self.neighbours(slot) {
                if self.fragments.of(next) == from {
                    self.fragments.of.set(next as usize, to);
                    queue.push(next);
                }
            }
        }
        self.fragments.shrink(from, count);
        self.fragments.grow(to, count);
    }

    /// The slots of the cells that share a face with a cell.
    pub(crate) fn neighbours(&mut self, slot: u32) -> Vec<u32> {
        let Some(volume) = self.volume(slot) else {
            return Vec::new();
        };
        let near = self.map.adjacent::<Volume, Face>(volume, &mut self.walk);
        near.map(|volume| self.slots[volume.index()]).collect()
    }

    /// Finds out what came loose beside faces that came apart or lost their neighbour. Of a fragment that falls apart, the
    /// part with most cells keeps the number.
    pub(crate) fn part_fragments(&mut self, made: &Made, effects: &mut Vec<Effect>) {
        let darts = made.opened.iter().flatten().chain(&made.bared);
        let mut seeds: Vec<_> = darts
            .map(|&dart| self.slot(self.map.volume(dart)))
            .collect();
        seeds.sort_unstable_by_key(|&slot| (self.fragments.of(slot), slot));
        seeds.dedup();
        for seeds in seeds
            .chunk_by(|&a, &b| self.fragments.of(a) == self.fragments.of(b))
            .map(<[u32]>::to_vec)
            .collect::<Vec<_>>()
        {
            self.part_fragment(&seeds, effects);
        }
    }

    fn part_fragment(&mut self, seeds: &[u32], effects: &mut Vec<Effect>) {
        let mut search = Search {
            cells: seeds.iter().map(|&seed| vec![seed]).collect(),
            done: vec![0; seeds.len()],
            part_of: (0..seeds.len()).collect(),
        };
        for (at, &seed) in (0..).zip(seeds) {
            self.fragments.met[seed as usize] = at;
        }
        let mut running: Vec<_> = (0..seeds.len()).collect();
        while running.len() > 1 {
            for &at in &running {
                if search.part_of[at] == at {
                    self.advance(&mut search, at);
                }
            }
            running.retain(|&at| search.part_of[at] == at && !search.is_over(at));
        }
        for cells in &search.cells {
            for &slot in cells {
                self.fragments.met[slot as usize] = NONE;
            }
        }
        let parent = self.fragments.of(seeds[0]);
        self.name_parts(search, running.first().copied(), parent, effects);
    }

    /// Does one cell of a search.
    fn advance(&mut self, search: &mut Search, at: usize) {
        let Some(&slot) = search.cells[at].get(search.done[at]) else {
            return;
        };
        search.done[at] += 1;
        let mut at = at;
        for next in self.neighbours(slot) {
            match self.fragments.met[next as usize] {
                NONE => {
                    self.fragments.met[next as usize] = number(at);
                    search.cells[at].push(next);
                }
                met => {
                    let other = search.root(met as usize);
                    if other != at {
                        search.unite(at, other);
                        at = search.root(at);
                    }
                }
            }
        }
    }

    /// Numbers the parts that were found whole, and if one was not, what is left.
    fn name_parts(
        &mut self,
        search: Search,
        unfinished: Option<usize>,
        parent: u32,
        effects: &mut Vec<Effect>,
    ) {
        let mut parts: Vec<Vec<u32>> = Vec::new();
        let mut left = self.fragments.sizes[parent as usize];
        let mut rest = None;
        for (at, mut cells) in search.cells.into_iter().enumerate() {
            if search.part_of[at] != at {
                continue;
            }
            cells.sort_unstable();
            if unfinished == Some(at) {
                rest = Some(cells);
            } else {
                left -= number(cells.len());
                parts.push(cells);
            }
        }
        parts.sort_unstable_by_key(|cells| (std::cmp::Reverse(cells.len()), cells[0]));
        // The greatest part keeps the number; what is left of two alike.
        match rest {
            Some(rest) if parts.first().is_some_and(|most| most.len() > left as usize) => {
                let rest = self.whole(rest[0]);
                parts.remove(0);
                parts.push(rest);
            }
            Some(_) => {}
            None => {
                parts.remove(0);
            }
        }
        for cells in parts {
            let fragment = number(self.fragments.sizes.len());
            let count = number(cells.len());
            self.fragments.sizes.push(count);
            self.fragments.shrink(parent, count);
            for slot in cells {
                self.fragments.of.set(slot as usize, fragment);
            }
            effects.push(Effect::FragmentBorn {
                fragment,
                parent,
                cells: count,
            });
        }
    }

    /// All cells that hold together with one.
    fn whole(&mut self, first: u32) -> Vec<u32> {
        let mut cells = vec![first];
        self.fragments.met[first as usize] = 0;
        let mut done = 0;
        while let Some(&slot) = cells.get(done) {
            done += 1;
            for next in self.neighbours(slot) {
                if self.fragments.met[next as usize] == NONE {
                    self.fragments.met[next as usize] = 0;
                    cells.push(next);
                }
            }
        }
        for &slot in &cells {
            self.fragments.met[slot as usize] = NONE;
        }
        cells
    }
}
