//! What is seen of a mesh, and in which colours.

use sinew_client::{
    Client, ClientError,
    sweep::{Colour, Shot, Sweep, View},
};
use sinew_mesh::{Surface, surface};

use super::picture::Light;

/// A plain surface, in linear light: a pale blue.
const PLAIN: Light = [0.28, 0.43, 0.62];
/// What was inside the mesh at rest: the dark red of the live view's fractures.
const INSIDE: Light = [0.45, 0.01, 0.02];

/// The surface of a shot.
pub(crate) struct Skin {
    pub(crate) surface: Surface,
    /// One per vertex of the surface.
    pub(crate) colours: Vec<Light>,
}

/// What colours the vertices of a view's mesh.
pub(crate) struct Palette {
    /// Of each vertex that is on the surface at rest.
    colours: Vec<Option<Light>>,
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
        };
        let mut colours = vec![None; rest.grid.positions.len()];
        for (vertex, light) in vertices.into_iter().zip(lights) {
            colours[vertex as usize] = Some(light);
        }
        Ok(Self { colours })
    }

    /// The surface of a shot; what was not on it at rest has come to light since.
    pub(crate) fn skin(&self, shot: &Shot) -> Skin {
        let surface = surface(&shot.grid.cells);
        let colour = |&vertex: &u32| self.colours.get(vertex as usize).copied().flatten();
        let colours = surface.vertices.iter().map(colour);
        Skin {
            colours: colours.map(|known| known.unwrap_or(INSIDE)).collect(),
            surface,
        }
    }
}

/// Colours that tell neighbouring indices apart: hues by the golden angle, in linear light.
fn of_point(index: u32) -> Light {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (0.58 + GOLDEN * f64::from(index)).fract() * std::f64::consts::TAU;
    #[expect(clippy::cast_possible_truncation, reason = "light has few digits")]
    let part = |shift: f64| (0.42 + 0.33 * (hue - shift).cos()) as f32;
    [part(0.0), part(2.094), part(4.189)]
}
