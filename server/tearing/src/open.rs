//! Opening faces and taking cells away.

use crate::commit::{Batch, Made};
use crate::{Body, Done, Refusal};

impl Body {
    /// Opens every face that these pairs of cells share.
    pub(crate) fn open(&mut self, facets: &[[u32; 2]], batch: &mut Batch) -> Result<Done, Refusal> {
        let mut darts = Vec::new();
        for &cells in facets {
            darts.extend(self.shared(cells)?);
        }
        let map = &self.map;
        darts.sort_unstable_by_key(|&dart| (map.face(dart), dart));
        darts.dedup_by_key(|dart| map.face(*dart));
        if darts.is_empty() {
            return Err(Refusal::Nothing);
        }
        let (made, changes) = self.map.edit(|edit| {
            let mut made = Made::default();
            for dart in darts {
                made.opened.push([dart, edit.unsew3(dart)?]);
            }
            Ok::<_, Refusal>(made)
        })?;
        Ok(self.commit(&changes, &made, batch))
    }

    /// Takes cells away.
    pub(crate) fn remove(&mut self, cells: &[u32], batch: &mut Batch) -> Result<Done, Refusal> {
        let mut cells = cells.to_vec();
        cells.sort_unstable();
        cells.dedup();
        if cells.is_empty() {
            return Err(Refusal::Nothing);
        }
        let mut made = Made::default();
        let mut volumes = Vec::new();
        for &slot in &cells {
            let volume = self.live(slot)?;
            volumes.push(volume);
            let beyond = self
                .map
                .orbit(volume, &mut self.walk)
                .filter_map(|dart| self.map.beta3(dart));
            made.bared.extend(beyond);
        }
        let map = &self.map;
        made.bared.retain(|&dart| {
            cells
                .binary_search(&self.slots[map.volume(dart).index()])
                .is_err()
        });
        made.bared
            .sort_unstable_by_key(|&dart| (map.face(dart), dart));
        made.bared.dedup_by_key(|dart| map.face(*dart));
        made.cells.clone_from(&cells);
        let ((), changes) = self.map.edit(|edit| {
            volumes
                .iter()
                .try_for_each(|&volume| edit.remove_volume(volume))?;
            Ok::<_, Refusal>(())
        })?;
        Ok(self.commit(&changes, &made, batch))
    }
}
