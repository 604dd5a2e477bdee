//! What is seen of a mesh, and in which colours.

use nalgebra::Vector3;
use sinew_client::{
    Client, ClientError,
    sweep::{Colour, Shot, Sweep, View},
};
use sinew_mesh::{Surface, surface};

use super::picture::Light;

/// A plain surface, in linear light: a pale blue.
const PLAIN: Light = [0.28, 0.43, 0.62];
/// Viridis in five steps, from no displacement to the end of the scale: as light to the eye as it is far.
const SCALE: [Light; 5] = [
    [0.055, 0.000, 0.087],
    [0.040, 0.082, 0.263],
    [0.011, 0.289, 0.267],
    [0.111, 0.592, 0.122],
    [0.983, 0.805, 0.014],
];
/// What was inside the mesh at rest: the dark red of the live view's fractures.
const INSIDE: Light = [0.45, 0.01, 0.02];

/// The surface of a shot.
pub(crate) struct Skin {
    pub(crate) surface: Surface,
    /// One per vertex of the surface.
    pub(crate) colours: Vec<Light>,
    /// One per point, where points have colours of their own, which change.
    pub(crate) points: Option<Vec<Light>>,
}

/// What colours the vertices of a view's mesh.
pub(crate) enum Palette {
    /// Always the same: of each vertex that is on the surface at rest.
    Still(Vec<Option<Light>>),
    /// By the distance from rest.
    Displacement {
        /// Vertices and points at rest, m.
        vertices: Vec<Vector3<f64>>,
        points: Vec<Vector3<f64>>,
        /// At the end of the scale, m.
        end: f64,
    },
}

impl Palette {
    /// Asks the server for what it does not know.
    pub(crate) async fn of(
        sweep: &Sweep,
        client: &Client,
        view: &View,
        rest: &Shot,
    ) -> Result<Self, ClientError> {
        let vertices = surface(&rest.grid.cells).vertices;
        let lights = match sweep.colour {
            Colour::Plain => vec![PLAIN; vertices.len()],
            Colour::Points => {
                let points = sweep.strongest(client, view, &vertices).await?;
                points.into_iter().map(of_point).collect()
            }
            Colour::Displacement(end) => {
                return Ok(Self::Displacement {
                    vertices: rest.grid.positions.clone(),
                    points: rest.points.clone(),
                    end,
                });
            }
        };
        let mut colours = vec![None; rest.grid.positions.len()];
        for (vertex, light) in vertices.into_iter().zip(lights) {
            colours[vertex as usize] = Some(light);
        }
        Ok(Self::Still(colours))
    }

    /// The surface of a shot; what was not on it at rest has come to light since.
    pub(crate) fn skin(&self, shot: &Shot) -> Skin {
        let surface = surface(&shot.grid.cells);
        let colour = |&vertex: &u32| {
            let vertex = vertex as usize;
            let known = match self {
                Self::Still(colours) => colours.get(vertex).copied().flatten(),
                Self::Displacement { vertices, end, .. } => vertices
                    .get(vertex)
                    .map(|rest| of_part((shot.grid.positions[vertex] - rest).norm() / end)),
            };
            known.unwrap_or(INSIDE)
        };
        Skin {
            colours: surface.vertices.iter().map(colour).collect(),
            points: self.points(shot),
            surface,
        }
    }

    /// Colours of the points, where they have colours of their own.
    fn points(&self, shot: &Shot) -> Option<Vec<Light>> {
        match self {
            Self::Still(_) => None,
            Self::Displacement { points, end, .. } => {
                let pairs = points.iter().zip(&shot.points);
                Some(
                    pairs
                        .map(|(rest, x)| of_part((x - rest).norm() / end))
                        .collect(),
                )
            }
        }
    }
}

/// The colour of a part, 0 to 1, of the scale.
fn of_part(part: f64) -> Light {
    #[expect(clippy::cast_possible_truncation, reason = "light has few digits")]
    let at = part.clamp(0.0, 1.0) as f32 * (SCALE.len() - 1) as f32;
    let lower = SCALE.iter().zip(&SCALE[1..]).zip(0_u8..);
    let (low, high, at) = lower
        .map(|((low, high), step)| (low, high, at - f32::from(step)))
        .find(|&(_, _, at)| at <= 1.0)
        .unwrap_or((&SCALE[0], &SCALE[0], 0.0));
    std::array::from_fn(|k| low[k] + (high[k] - low[k]) * at)
}

/// Colours that tell neighbouring indices apart: hues by the golden angle, in linear light.
fn of_point(index: u32) -> Light {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (0.58 + GOLDEN * f64::from(index)).fract() * std::f64::consts::TAU;
    #[expect(clippy::cast_possible_truncation, reason = "light has few digits")]
    let part = |shift: f64| (0.42 + 0.33 * (hue - shift).cos()) as f32;
    [part(0.0), part(2.094), part(4.189)]
}
