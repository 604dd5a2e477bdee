//! Dividing cells, and drawing edges together.

use sinew_topology::{AnyCell, Cell, Edge, EditError, Face, Vertex, Volume};

use crate::commit::{Batch, Made};
use crate::shape::{Upright, is_cell, is_tetrahedron};
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
        let upright = Upright::of(&self.map, &self.rest, &volumes);
        let (slots, rest) = (&self.slots, &self.rest);
        let ((), changes) = self.map.edit(|edit| {
            if edit.attempt(|edit| edit.split_hexahedra(&volumes)).is_err() {
                for &volume in &volumes {
                    edit.star(volume)?;
                }
            }
            let folded = upright.folded(edit, rest);
            match folded.is_empty() {
                true => Ok(()),
                false => Err(Refusal::Blind {
                    cells: slots_of(slots, &folded),
                }),
            }
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
        let (map, walk) = (&self.map, &mut self.walk);
        let around = cells.iter().filter_map(|&slot| self.volumes[slot as usize]);
        let mut others: Vec<_> = around.filter(|&v| !is_tetrahedron(map, v, walk)).collect();
        others.sort_unstable();
        others.dedup();
        if !others.is_empty() {
            let cells = slots_of(&self.slots, &others);
            return Err(Refusal::NoTetrahedra { cells });
        }
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
    pub(crate) fn collapse(
        &mut self,
        vertices: [u32; 2],
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        let (edges, cells) = self.edges(&[vertices])?;
        let (edge, kept) = (edges[0], self.map.cell_at::<Vertex>(vertices[0] as usize));
        let kept = kept.expect("one end of the edge");
        let near = self.near(vertices);
        let upright = Upright::of(&self.map, &self.rest, &near);
        let (slots, rest, walk) = (&self.slots, &self.rest, &mut self.walk);
        let ((), changes) = self.map.edit(|edit| {
            edit.collapse(edge, kept).map_err(|error| {
                let EditError::NotCollapsible { at, reason, .. } = error else {
                    return Refusal::Edit(error);
                };
                let cells = match at {
                    AnyCell::Volume(volume) => vec![slots[volume.index()]],
                    AnyCell::Vertex(_) | AnyCell::Edge(_) | AnyCell::Face(_) => cells.clone(),
                };
                Refusal::Tangled {
                    vertices,
                    reason,
                    cells,
                }
            })?;
            let map = edit.map();
            let alive = near
                .iter()
                .filter(|&&volume| map.try_dart(volume).is_some());
            let spoilt: Vec<_> = alive
                .copied()
                .filter(|&volume| !is_cell(map, volume, walk))
                .collect();
            if !spoilt.is_empty() {
                let cells = slots_of(slots, &spoilt);
                return Err(Refusal::Spoilt { cells });
            }
            let folded = upright.folded(edit, rest);
            match folded.is_empty() {
                true => Ok(()),
                false => Err(Refusal::Folds {
                    vertices,
                    cells: slots_of(slots, &folded),
                }),
            }
        })?;
        let made = Made {
            cells,
            ..Made::default()
        };
        Ok(self.commit(&changes, &made, batch))
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

fn slots_of(slots: &[u32], volumes: &[Cell<Volume>]) -> Vec<u32> {
    let mut slots: Vec<_> = volumes.iter().map(|v| slots[v.index()]).collect();
    slots.sort_unstable();
    slots
}
