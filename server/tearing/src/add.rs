//! New material on faces of the boundary.

use nalgebra::Vector3;
use sinew_topology::Dart;

use crate::commit::{Batch, Made};
use crate::{Body, Done, Facet, Refusal};

impl Body {
    /// Adds a prism over each of some faces of the boundary, as high as asked at rest.
    pub(crate) fn add(
        &mut self,
        facets: &[Facet],
        thickness: f64,
        batch: &mut Batch,
    ) -> Result<Done, Refusal> {
        if facets.is_empty() {
            return Err(Refusal::Nothing);
        }
        if !(thickness > 0.0 && thickness.is_finite()) {
            return Err(Refusal::Thickness { thickness });
        }
        let mut bases = Vec::new();
        for facet in facets {
            let dart = self.free(facet)?;
            let corners: Vec<_> = self.map.ring(dart).collect();
            bases.push((dart, self.raised(&corners, thickness)));
        }
        let (made, changes) = self.map.edit(|edit| {
            let mut made = Made::default();
            for (dart, places) in bases {
                let count = places.len();
                let rings = prism(count);
                let rings: Vec<&[usize]> = rings.iter().map(Vec::as_slice).collect();
                let added = edit.add_volume(&rings)?;
                let places = places
                    .into_iter()
                    .flat_map(|[base, top]| [(0, base), (count, top)]);
                let places = places.enumerate();
                made.placed.extend(
                    places.map(|(at, (level, place))| (added.vertices[level + at / 2], place)),
                );
                edit.sew3(dart, added.rings[0])?;
                made.closed.push([dart, added.rings[0]]);
            }
            made.placed.sort_unstable_by_key(|placed| placed.0);
            Ok::<_, Refusal>(made)
        })?;
        Ok(self.commit(&changes, &made, batch))
    }

    /// Of each corner of a face where it is at rest, and where its copy above is.
    fn raised(&self, corners: &[Dart], thickness: f64) -> Vec<[Vector3<f64>; 2]> {
        let at = |dart: &Dart| self.rest[self.map.vertex(*dart).index()];
        let first = at(&corners[0]);
        let pairs = corners[1..].windows(2);
        let area = pairs.map(|pair| (at(&pair[0]) - first).cross(&(at(&pair[1]) - first)));
        let normal = area.sum::<Vector3<f64>>().try_normalize(0.0);
        let up = thickness * normal.unwrap_or_else(Vector3::zeros);
        corners
            .iter()
            .map(|dart| [at(dart), at(dart) + up])
            .collect()
    }
}

/// The faces of a prism over a polygon: the base, whose first dart runs against the polygon's first edge, the top, and the
/// sides.
fn prism(count: usize) -> Vec<Vec<usize>> {
    let base = (0..count).rev().map(|corner| (corner + 2) % count);
    let mut rings = vec![base.collect(), (count..2 * count).collect()];
    rings.extend((0..count).map(|corner| {
        let next = (corner + 1) % count;
        vec![corner, next, count + next, count + corner]
    }));
    rings
}
