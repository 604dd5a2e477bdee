//! Cells that are met in parts: what two parts were named before they turned out to be one means the same.

use super::rings::number;
use crate::Dart;
use crate::slots::NONE;

/// Names of parts of orbits, ascending by the first dart that got each.
#[derive(Debug, Default)]
pub(super) struct Names {
    /// An earlier name of the same orbit, or the name itself.
    same_as: Vec<u32>,
    first: Vec<Dart>,
}

impl Names {
    pub(super) fn make(&mut self, dart: usize) -> u32 {
        let name = number(self.same_as.len());
        self.same_as.push(name);
        self.first.push(Dart::at(dart));
        name
    }

    fn earliest(&mut self, mut name: u32) -> u32 {
        loop {
            let parent = self.same_as[name as usize];
            if parent == name {
                return name;
            }
            let beyond = self.same_as[parent as usize];
            self.same_as[name as usize] = beyond;
            name = beyond;
        }
    }

    /// The name of a part that had the name `here`, or [`NONE`], and turns out to be one with the part `there`.
    #[inline]
    pub(super) fn join(&mut self, here: u32, there: u32) -> u32 {
        if here == NONE || here == there {
            return there;
        }
        let [one, other] = [here, there].map(|name| self.earliest(name));
        self.same_as[one.max(other) as usize] = one.min(other);
        one.min(other)
    }

    /// Puts labels in place of names: `label` is asked once for each orbit, by ascending names, with its first dart.
    pub(super) fn settle(mut self, column: &mut [u32], mut label: impl FnMut(usize, Dart) -> u32) {
        for name in 0..self.same_as.len() {
            let same_as = self.same_as[name] as usize;
            self.same_as[name] = if same_as == name {
                label(name, self.first[name])
            } else {
                // It is earlier, so that its label is here already.
                self.same_as[same_as]
            };
        }
        for name in column {
            *name = self.same_as[*name as usize];
        }
    }
}
