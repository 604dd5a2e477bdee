//! A shaded surface as pixels, without a display.

use nalgebra::{Matrix3, Vector2, Vector3};
use sinew_mesh::vertex_normals;
use sinew_proto::v1::UpAxis;

use super::skin::Skin;

/// Linear light: red, green, blue, 0 to 1.
pub(crate) type Light = [f32; 3];

/// Samples along each side of a pixel: edges look smooth.
const SAMPLES: usize = 3;
/// From where the scene is seen, about the upward axis and above the ground, radians.
const AZIMUTH: f64 = 0.55;
const ELEVATION: f64 = 0.35;
const BACKGROUND: Light = [0.93, 0.94, 0.95];
const POINT: Light = [0.75, 0.05, 0.02];
/// Radius of a point, of the picture's width.
const POINT_RADIUS: f64 = 0.0075;

/// An orthographic eye, so that sizes compare from picture to picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    /// Rows: right, up, towards the eye.
    eye_from_world: Matrix3<f64>,
    centre: Vector2<f64>,
    /// Pixels per metre.
    scale: f64,
}

impl Eye {
    /// Sees all of these positions in a picture of this size.
    pub(crate) fn on<'a>(
        positions: impl Iterator<Item = &'a Vector3<f64>>,
        up: UpAxis,
        [width, height]: [usize; 2],
    ) -> Self {
        let eye_from_world = eye_from_world(up);
        let (mut low, mut high) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for position in positions {
            let seen = (eye_from_world * position).xy();
            (low, high) = (low.inf(&seen), high.sup(&seen));
        }
        let size = (high - low).sup(&Vector2::repeat(f64::MIN_POSITIVE));
        #[expect(clippy::cast_precision_loss, reason = "pixels")]
        let fit = (0.9 * width as f64 / size.x).min(0.9 * height as f64 / size.y);
        Self {
            eye_from_world,
            centre: (low + high) / 2.0,
            scale: fit,
        }
    }
}

fn eye_from_world(up: UpAxis) -> Matrix3<f64> {
    let (sin, cos) = AZIMUTH.sin_cos();
    let (up, towards) = match up {
        UpAxis::Y => (Vector3::y(), Vector3::new(sin, 0.0, cos)),
        UpAxis::Unspecified | UpAxis::Z => (Vector3::z(), Vector3::new(sin, -cos, 0.0)),
    };
    let towards = ELEVATION.cos() * towards + ELEVATION.sin() * up;
    let right = up.cross(&towards).normalize();
    Matrix3::from_rows(&[
        right.transpose(),
        towards.cross(&right).transpose(),
        towards.transpose(),
    ])
}

/// What is drawn.
pub(crate) struct Subject<'a> {
    pub(crate) positions: &'a [Vector3<f64>],
    pub(crate) skin: &'a Skin,
    /// Drawn over the surface, for they stand inside of it.
    pub(crate) points: &'a [Vector3<f64>],
}

/// Pixels, row after row from the top.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub(crate) size: [usize; 2],
    pub(crate) pixels: Vec<Light>,
}

/// Draws a surface.
pub(crate) fn draw(subject: &Subject<'_>, eye: &Eye, size: [usize; 2]) -> Picture {
    let mut canvas = Canvas::new(size);
    let mut normals = Vec::new();
    vertex_normals(subject.positions, &subject.skin.surface, &mut normals);
    let corners: Vec<Corner> = subject
        .skin
        .surface
        .vertices
        .iter()
        .zip(&normals)
        .zip(&subject.skin.colours)
        .map(|((&vertex, normal), colour)| Corner {
            at: canvas.place(&subject.positions[vertex as usize], eye),
            normal: eye.eye_from_world * Vector3::from(*normal).cast(),
            colour: *colour,
        })
        .collect();
    for triangle in &subject.skin.surface.triangles {
        canvas.triangle(triangle.map(|corner| &corners[corner as usize]));
    }
    for point in subject.points {
        let at = canvas.place(point, eye);
        canvas.dot(at);
    }
    canvas.averaged()
}

struct Corner {
    /// Samples to the right, samples down, metres towards the eye.
    at: Vector3<f64>,
    normal: Vector3<f64>,
    colour: Light,
}

/// Samples with their depths.
struct Canvas {
    width: usize,
    height: usize,
    colours: Vec<Light>,
    /// Towards the eye, m.
    depths: Vec<f64>,
}

impl Canvas {
    fn new([width, height]: [usize; 2]) -> Self {
        let (width, height) = (width * SAMPLES, height * SAMPLES);
        Self {
            width,
            height,
            colours: vec![BACKGROUND; width * height],
            depths: vec![f64::NEG_INFINITY; width * height],
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    fn place(&self, position: &Vector3<f64>, eye: &Eye) -> Vector3<f64> {
        let seen = eye.eye_from_world * position;
        let scale = eye.scale * SAMPLES as f64;
        Vector3::new(
            self.width as f64 / 2.0 + scale * (seen.x - eye.centre.x),
            self.height as f64 / 2.0 - scale * (seen.y - eye.centre.y),
            seen.z,
        )
    }

    /// The samples from `low` to `high`, as far as they are on the canvas.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "`as` saturates at the canvas's edges"
    )]
    fn span(low: f64, high: f64, end: usize) -> std::ops::Range<usize> {
        (low.ceil().max(0.0) as usize)..((high.floor() + 1.0).max(0.0) as usize).min(end)
    }

    fn triangle(&mut self, corners: [&Corner; 3]) {
        let [a, b, c] = corners.map(|corner| corner.at);
        let area = cross(&(b - a), &(c - a));
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let low = a.inf(&b).inf(&c);
        let high = a.sup(&b).sup(&c);
        for y in Self::span(low.y, high.y, self.height) {
            for x in Self::span(low.x, high.x, self.width) {
                #[expect(clippy::cast_precision_loss, reason = "pixels")]
                let at = Vector3::new(x as f64, y as f64, 0.0);
                let shares = [
                    cross(&(c - b), &(at - b)) / area,
                    cross(&(a - c), &(at - c)) / area,
                    cross(&(b - a), &(at - a)) / area,
                ];
                if shares.iter().any(|share| *share < 0.0) {
                    continue;
                }
                let depth = shares[0] * a.z + shares[1] * b.z + shares[2] * c.z;
                let sample = y * self.width + x;
                if depth > self.depths[sample] {
                    self.depths[sample] = depth;
                    self.colours[sample] = shade(corners, shares);
                }
            }
        }
    }

    /// A point of the motion, whatever stands before it.
    #[expect(clippy::cast_precision_loss, reason = "pixels")]
    fn dot(&mut self, at: Vector3<f64>) {
        let radius = POINT_RADIUS * self.width as f64;
        for y in Self::span(at.y - radius, at.y + radius, self.height) {
            for x in Self::span(at.x - radius, at.x + radius, self.width) {
                let away = Vector2::new(x as f64 - at.x, y as f64 - at.y).norm() / radius;
                if away <= 1.0 {
                    // A light rim sets it off from the surface.
                    let colour = if away > 0.72 { [1.0; 3] } else { POINT };
                    self.colours[y * self.width + x] = colour;
                }
            }
        }
    }

    fn averaged(&self) -> Picture {
        let size = [self.width / SAMPLES, self.height / SAMPLES];
        let mut pixels = Vec::with_capacity(size[0] * size[1]);
        #[expect(clippy::cast_precision_loss, reason = "9")]
        let share = 1.0 / (SAMPLES * SAMPLES) as f32;
        for y in 0..size[1] {
            for x in 0..size[0] {
                let mut sum = [0.0; 3];
                for sample in 0..SAMPLES * SAMPLES {
                    let row = y * SAMPLES + sample / SAMPLES;
                    let colour = self.colours[row * self.width + x * SAMPLES + sample % SAMPLES];
                    for (sum, part) in sum.iter_mut().zip(colour) {
                        *sum += share * part;
                    }
                }
                pixels.push(sum);
            }
        }
        Picture { size, pixels }
    }
}

fn cross(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// A lamp over the left shoulder, a weak one from the right, and light from everywhere.
#[expect(clippy::cast_possible_truncation, reason = "light has few digits")]
fn shade(corners: [&Corner; 3], shares: [f64; 3]) -> Light {
    let mix = |of: fn(&Corner) -> Vector3<f64>| -> Vector3<f64> {
        corners
            .iter()
            .zip(shares)
            .map(|(corner, share)| share * of(corner))
            .sum()
    };
    let normal = mix(|corner| corner.normal);
    let normal = normal.try_normalize(0.0).unwrap_or(Vector3::z());
    // What is seen faces the eye: a cell turned inside out is lit as well.
    let normal = if normal.z < 0.0 { -normal } else { normal };
    let from = |x: f64, y: f64, z: f64| Vector3::new(x, y, z).normalize().dot(&normal).max(0.0);
    let light = 0.22 + 0.68 * from(-0.5, 0.7, 0.6) + 0.18 * from(0.8, 0.1, 0.4);
    let gloss = 0.12 * from(-0.28, 0.4, 0.87).powi(40);
    let colour = mix(|corner| Vector3::from(corner.colour).cast());
    let lit = (light * colour).add_scalar(gloss);
    [lit.x as f32, lit.y as f32, lit.z as f32]
}

#[cfg(test)]
mod tests {
    use sinew_mesh::{shapes, surface};

    use super::*;

    fn cube(turned_inside_out: bool) -> Picture {
        let mut grid = shapes::hexahedra(1, 1, 1);
        if turned_inside_out {
            for position in &mut grid.positions {
                position.x = 1.0 - position.x;
            }
        }
        let surface = surface(&grid.cells);
        let colours = vec![[0.5; 3]; surface.vertices.len()];
        let subject = Subject {
            positions: &grid.positions,
            skin: &Skin {
                surface,
                colours,
                points: None,
            },
            points: &[],
        };
        let size = [40, 30];
        draw(
            &subject,
            &Eye::on(grid.positions.iter(), UpAxis::Z, size),
            size,
        )
    }

    #[test]
    fn a_cube_fills_the_middle_and_leaves_the_corners() {
        for picture in [cube(false), cube(true)] {
            let at = |x: usize, y: usize| picture.pixels[y * picture.size[0] + x];
            // Up to the rounding of a mean of equal samples.
            let is_background = |pixel: Light| {
                let mut parts = pixel.iter().zip(BACKGROUND);
                parts.all(|(part, of)| (part - of).abs() < 1e-6)
            };
            assert!(!is_background(at(20, 15)));
            for corner in [at(0, 0), at(39, 0), at(0, 29), at(39, 29)] {
                assert!(is_background(corner), "{corner:?}");
            }
        }
    }

    #[test]
    fn what_is_nearer_hides_what_is_farther() {
        let mut grid = shapes::hexahedra(1, 1, 1);
        let behind = grid.positions.len();
        let far = Vector3::new(
            -ELEVATION.cos() * AZIMUTH.sin(),
            ELEVATION.cos() * AZIMUTH.cos(),
            -ELEVATION.sin(),
        );
        let triangle = [Vector3::zeros(), Vector3::x(), Vector3::z()];
        grid.positions
            .extend(triangle.map(|corner| corner + 5.0 * far + Vector3::repeat(0.2)));
        let mut surface = surface(&grid.cells);
        let first = u32::try_from(surface.vertices.len()).unwrap();
        surface
            .vertices
            .extend((behind..behind + 3).map(|i| u32::try_from(i).unwrap()));
        surface.triangles.push([first, first + 1, first + 2]);
        let mut colours = vec![[0.5; 3]; surface.vertices.len()];
        colours[first as usize..].fill([0.0, 0.0, 9.0]);
        let subject = Subject {
            positions: &grid.positions,
            skin: &Skin {
                surface,
                colours,
                points: None,
            },
            points: &[],
        };
        let size = [40, 30];
        let picture = draw(
            &subject,
            &Eye::on(grid.positions[..8].iter(), UpAxis::Z, size),
            size,
        );
        let middle = picture.pixels[15 * 40 + 20];
        assert!(middle[2] < 1.0, "{middle:?}");
    }

    #[test]
    fn an_eye_looks_from_above_with_up_upwards() {
        for (up, axis) in [(UpAxis::Y, Vector3::y()), (UpAxis::Z, Vector3::z())] {
            let seen = eye_from_world(up) * axis;
            assert!(
                seen.x.abs() < 1e-12 && seen.y > 0.9 && seen.z > 0.0,
                "{seen}"
            );
            assert!((eye_from_world(up).determinant() - 1.0).abs() < 1e-12);
        }
    }
}
