//! Dividing cells, and drawing edges together.

use sinew_topology::{Cell, Edge, Face, Vertex, Volume};

use crate::commit::{Batch, Made};
use crate::shape::is_cell;
use crate::{Body, Done, Refusal};

impl Body {
    /// Divides cells: hexahedra in eight each if all are, else each from its centre in a pyramid over each face.
    pub(crate) fn subdivide(&mut self, cells: &[u32], batch: &mut Batch) -> Result<Done, Refusal> {
        let mut cells = cells.to_vec();
        cells.sort_unstable();
        cells.dedup();
        let volumes = cells.iter().map(|&slot| self.live(slot));
        let volumes = volumes.collect::<Result<Vec<_>, _>>()?;
        if volumes.is_empty() {
            return Err(Refusal::Nothing);
        }
        let ((), changes) = self.map.edit(|edit| {
            if edit.attempt(|edit| edit.split_hexahedra(&volumes)).is_err() {
                for &volume in &volumes {
                    edit.star(volume)?;
                }
            }
            Ok::<_, Refusal>(())
        })?;
        let made = Made {
            cells,
            ..Made::default()
        };
        Ok(self.commit(&changes, &made, batch))
    }

    /// Halves edges, and with each all tetrahedra around it.
    pub(crate) fn bisect(
        &mut self,
        edges: &[[u32; 2]],
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        let (edges, cells) = self.edges(edges)?;
        let ((), changes) = self.map.edit(|edit| {
            edges
                .iter()
                .try_for_each(|&edge| edit.bisect(edge).map(drop))?;
            Ok::<_, Refusal>(())
        })?;
        let made = Made {
            cells,
            ..Made::default()
        };
        Ok(self.commit(&changes, &made, batch))
    }

    /// Draws an edge together to the first of its vertices.
    pub(crate) fn collapse(&mut self, edge: [u32; 2], batch: &mut Batch) -> Result<Done, Refusal> {
        let (edges, cells) = self.edges(&[edge])?;
        let kept = self.rest[edge[0] as usize];
        let near = self.near(edge);
        let (slots, walk) = (&self.slots, &mut self.walk);
        let (vertex, changes) = self.map.edit(|edit| {
            let vertex = edit.collapse(edges[0])?;
            let map = edit.map();
            let mut is_spoilt = |volume: &Cell<Volume>| {
                map.try_dart(*volume).is_some() && !is_cell(map, *volume, walk)
            };
            let spoilt: Vec<_> = near.into_iter().filter(&mut is_spoilt).collect();
            if spoilt.is_empty() {
                return Ok(vertex);
            }
            let cells = spoilt.iter().map(|volume| slots[volume.index()]).collect();
            Err(Refusal::Spoilt { cells })
        })?;
        let made = Made {
            cells,
            ..Made::default()
        };
        let done = self.commit(&changes, &made, batch);
        // The map may keep either name.
        self.rest.set(vertex.index(), kept);
        Ok(done)
    }

    /// The volumes at the ends of an edge, and those beside them.
    fn near(&mut self, edge: [u32; 2]) -> Vec<Cell<Volume>> {
        let map = &self.map;
        let mut volumes = Vec::new();
        for end in edge
            .map(|end| map.cell_at::<Vertex>(end as usize))
            .into_iter()
            .flatten()
        {
            volumes.extend(map.incident::<Vertex, Volume>(end, &mut self.walk));
        }
        for at in 0..volumes.len() {
            volumes.extend(map.adjacent::<Volume, Face>(volumes[at], &mut self.walk));
        }
        volumes.sort_unstable();
        volumes.dedup();
        volumes
    }

    /// Edges by the vertices at their ends, each once, and the slots of the cells around them.
    fn edges(&mut self, ends: &[[u32; 2]]) -> Result<(Vec<Cell<Edge>>, Vec<u32>), Refusal> {
        let (mut edges, mut cells) = (Vec::new(), Vec::new());
        for &vertices in ends {
            let missing = Refusal::NoEdge { vertices };
            let [from, to] = vertices.map(|vertex| self.map.cell_at::<Vertex>(vertex as usize));
            let (Some(from), Some(to)) = (from, to) else {
                return Err(missing);
            };
            let map = &self.map;
            let found = map.incident::<Vertex, Edge>(from, &mut self.walk);
            let edge = found.filter(|&edge| map.ends(edge).contains(&to)).min();
            let edge = edge.filter(|_| from != to).ok_or(missing)?;
            let around = map.incident::<Edge, Volume>(edge, &mut self.walk);
            cells.extend(around.map(|volume| self.slots[volume.index()]));
            edges.push(edge);
        }
        edges.sort_unstable();
        edges.dedup();
        match edges.is_empty() {
            true => Err(Refusal::Nothing),
            false => Ok((edges, cells)),
        }
    }
}
