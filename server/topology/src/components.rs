//! Connected components, and the numbers that tell them apart.

use crate::orbit::Walk;
use crate::{Cell, Dart, Map, Volume};

/// What is connected by β1, β2 and β3.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// The first volume of it.
    pub first: Cell<Volume>,
    /// How many vertices, edges, faces and volumes there are. In a 2-map, the last is 1.
    pub counts: [usize; 4],
    /// Faces (in a 2-map, edges) with nothing on one side.
    pub boundary: usize,
}

impl Component {
    /// Vertices − edges + faces − volumes: 1 for a ball, 0 for a solid ring. Of a surface, vertices − edges + faces: 2 for a
    /// sphere, 1 for a disc, 0 for a torus.
    pub fn euler_characteristic(&self, map: &Map) -> i64 {
        let [vertices, edges, faces, volumes] = self
            .counts
            .map(|count| i64::try_from(count).expect("fewer than there are darts"));
        let enclosed = match map.dimension() {
            crate::Dimension::Two => 0,
            crate::Dimension::Three => volumes,
        };
        vertices - edges + faces - enclosed
    }
}

impl Map {
    /// The connected components, by their first darts. Linear.
    pub fn components(&self) -> Vec<Component> {
        let mut seen = Walk::default();
        seen.restart(self);
        let mut cells: [Vec<bool>; 4] =
            [0, 1, 2, 3].map(|dimension| vec![false; self.slots[dimension].dart.len()]);
        let mut components = Vec::new();
        let mut done = 0;
        for dart in self.darts() {
            if seen.has(dart) {
                continue;
            }
            seen.push(dart);
            let mut found = Component {
                first: self.volume(dart),
                counts: [0; 4],
                boundary: 0,
            };
            while let Some(&dart) = seen.darts().get(done) {
                done += 1;
                for (dimension, cells) in cells.iter_mut().enumerate() {
                    let cell = &mut cells[self.label_in(dimension, dart) as usize];
                    found.counts[dimension] += usize::from(!*cell);
                    *cell = true;
                }
                found.boundary += usize::from(self.is_border(dart));
                seen.push(self.beta1(dart));
                for next in [self.beta2(dart), self.beta3(dart)].into_iter().flatten() {
                    seen.push(next);
                }
            }
            components.push(found);
        }
        components
    }

    /// Whether `dart` stands for a boundary face (the one that its label names), or in a 2-map is a border edge.
    fn is_border(&self, dart: Dart) -> bool {
        match self.dimension {
            crate::Dimension::Two => self.beta2(dart).is_none(),
            crate::Dimension::Three => {
                self.beta3(dart).is_none() && self.dart(self.face(dart)) == dart
            }
        }
    }
}
