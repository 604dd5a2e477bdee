//! Scenes for tests, as a client posts them.

use sinew_mesh::{Cell, CellType, Grid, shapes};
use sinew_proto::v1::{
    self, CellShape, ExternalPoints, Fill, Indices, Lattice, Mapping, MassSpring, Mesh, Motion,
    MotionRule, Pace, Precision, Reals, Scene, ShapeMatching, UnstructuredGrid, Vector3,
    WeightedMean, mesh, motion, motion_rule,
};

/// How the points drive the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The weighted mean of the points' displacements.
    Mean,
    /// The rigid motion that fits best.
    Rigid,
}

/// A box of hexahedra in the unit cube that `points` labelled points in it drive.
pub fn block(points: usize, cubes: usize, rule: Rule) -> Scene {
    Scene {
        title: format!("{points} points drive {cubes}³ cubes"),
        motion: Some(external(points)),
        mesh: meshed(mesh::Source::Grid(grid(&shapes::hexahedra(
            cubes, cubes, cubes,
        )))),
        mapping: Some(mapping(rule)),
        ..Scene::default()
    }
}

/// A small scene with external motion: 8 points, 8 cubes.
pub fn small() -> Scene {
    block(8, 2, Rule::Mean)
}

/// The [`block`] of cubes, posted as no more than the surface of the unit cube, with its filling.
pub fn filled(points: usize, cubes: usize, rule: Rule) -> Scene {
    let corners = shapes::hexahedra(1, 1, 1);
    let surface = sinew_mesh::surface(&corners.cells);
    let mut skin = Grid {
        positions: corners.positions,
        ..Grid::default()
    };
    for triangle in &surface.triangles {
        skin.cells.push(Cell {
            kind: CellType::Triangle,
            vertices: triangle,
            face_stream: &[],
        });
    }
    let fill = Fill {
        shape: CellShape::Hexahedron.into(),
        spacing: (cubes as f64).recip(),
    };
    Scene {
        mesh: Some(Mesh {
            source: Some(mesh::Source::Grid(grid(&skin))),
            fill: Some(fill),
            ..Mesh::default()
        }),
        ..block(points, cubes, rule)
    }
}

/// The labels `p0`, `p1`, … of the points of [`block`].
pub fn labels(points: usize) -> Vec<String> {
    (0..points).map(|i| format!("p{i}")).collect()
}

/// Where the points of [`block`] are at rest, m: spread evenly in the unit cube, never two in one place.
pub fn rest(points: usize) -> Vec<[f64; 3]> {
    // The additive sequence of Roberts, in three dimensions: powers of the root of x⁴ = x + 1.
    let g: f64 = 1.220_744_084_605_759_5;
    let steps = [g.recip(), g.powi(-2), g.powi(-3)];
    let at = |i: usize| steps.map(|step| (0.5 + step * (i + 1) as f64).fract());
    (0..points).map(at).collect()
}

/// The points of [`block`], twisted and bent, m.
pub fn bent(points: usize, angle: f64) -> Vec<[f64; 3]> {
    let twist = |p: &[f64; 3]| {
        let (sin, cos) = (angle * p[2]).sin_cos();
        [
            cos * p[0] - sin * p[1],
            sin * p[0] + cos * p[1],
            p[2] + angle * p[0] * p[0],
        ]
    };
    rest(points).iter().map(twist).collect()
}

fn external(points: usize) -> Motion {
    let rest = rest(points);
    Motion {
        source: Some(motion::Source::External(ExternalPoints {
            labels: labels(points),
            rest_positions: Some(reals(rest.as_flattened())),
            rate_hz: 100.0,
            ..ExternalPoints::default()
        })),
    }
}

/// A mapping of which the rule alone is given.
pub fn mapping(rule: Rule) -> Mapping {
    let kind = match rule {
        Rule::Mean => motion_rule::Kind::WeightedMean(WeightedMean {}),
        Rule::Rigid => motion_rule::Kind::ShapeMatching(ShapeMatching::default()),
    };
    Mapping {
        rule: Some(MotionRule { kind: Some(kind) }),
        ..Mapping::default()
    }
}

/// A hanging sheet of `side`² masses with springs along its rows and columns, its first row fixed, and a lattice
/// around it; steps of 1 ms, one at once after the other.
pub fn sheet(side: u32) -> Scene {
    let spacing = 0.1;
    let place = |i: u32| f64::from(i) * spacing;
    let positions: Vec<[f64; 3]> = (0..side * side)
        .map(|i| [place(i % side), 0.0, -place(i / side)])
        .collect();
    let rows = (0..side * side)
        .filter(|i| i % side + 1 < side)
        .flat_map(|i| [i, i + 1]);
    let columns = (0..side * (side - 1)).flat_map(|i| [i, i + side]);
    let springs: Vec<u32> = rows.chain(columns).collect();
    Scene {
        title: "a hanging sheet".to_owned(),
        motion: Some(Motion {
            source: Some(motion::Source::MassSpring(MassSpring {
                positions: Some(reals(positions.as_flattened())),
                masses: Some(reals(&[0.01])),
                fixed: Some(Indices::pack(&(0..side).collect::<Vec<_>>())),
                springs: Some(Indices::pack(&springs)),
                stiffness: Some(reals(&[100.0])),
                damping: Some(reals(&[0.05])),
                gravity: Some(Vector3 {
                    x: 0.0,
                    y: 0.0,
                    z: -9.81,
                }),
                ..MassSpring::default()
            })),
        }),
        mesh: meshed(mesh::Source::Lattice(Lattice {
            shape: CellShape::Hexahedron.into(),
            spacing,
            radius: 1.1 * spacing,
            bones: Vec::new(),
        })),
        time_step_seconds: 1e-3,
        pace: Pace::Unpaced.into(),
        ..Scene::default()
    }
}

/// A sheet whose springs are far too stiff for its steps.
pub fn explosive() -> Scene {
    let mut scene = sheet(3);
    network(&mut scene).stiffness = Some(reals(&[1e9]));
    // A push out of rest, for something to grow.
    let mut velocities = [0.0; 27];
    velocities[26] = 1.0;
    network(&mut scene).velocities = Some(reals(&velocities));
    scene
}

/// The scene's external points.
pub fn points(scene: &mut Scene) -> &mut ExternalPoints {
    match scene
        .motion
        .as_mut()
        .and_then(|motion| motion.source.as_mut())
    {
        Some(motion::Source::External(points)) => points,
        other => panic!("{other:?} is not external"),
    }
}

/// The scene's network.
pub fn network(scene: &mut Scene) -> &mut MassSpring {
    match scene
        .motion
        .as_mut()
        .and_then(|motion| motion.source.as_mut())
    {
        Some(motion::Source::MassSpring(network)) => network,
        other => panic!("{other:?} is no network"),
    }
}

/// The scene's grid.
pub fn mesh(scene: &mut Scene) -> &mut UnstructuredGrid {
    match scene.mesh.as_mut().and_then(|mesh| mesh.source.as_mut()) {
        Some(mesh::Source::Grid(grid)) => grid,
        other => panic!("{other:?} is no grid"),
    }
}

/// The scene's lattice.
pub fn lattice(scene: &mut Scene) -> &mut Lattice {
    match scene.mesh.as_mut().and_then(|mesh| mesh.source.as_mut()) {
        Some(mesh::Source::Lattice(lattice)) => lattice,
        other => panic!("{other:?} is no lattice"),
    }
}

/// A grid as it travels, at full precision.
pub fn grid(grid: &Grid) -> UnstructuredGrid {
    let cells = &grid.cells;
    let positions: Vec<f64> = grid
        .positions
        .iter()
        .flat_map(|x| [x.x, x.y, x.z])
        .collect();
    UnstructuredGrid {
        positions: Some(reals(&positions)),
        cell_types: cells.types.clone().into(),
        connectivity: Some(Indices::pack(&cells.connectivity)),
        offsets: Some(Indices::pack(&cells.offsets)),
        faces: Some(Indices::pack(&cells.faces)),
        face_offsets: Some(Indices::pack(&cells.face_offsets)),
    }
}

/// Numbers at full precision.
pub fn reals(numbers: &[f64]) -> Reals {
    Reals::pack(numbers, Precision::F64)
}

/// A mesh from this source.
pub fn meshed(source: mesh::Source) -> Option<Mesh> {
    Some(Mesh {
        source: Some(source),
        ..Mesh::default()
    })
}

/// Points moved by a vector.
pub fn translated(points: &[[f64; 3]], by: [f64; 3]) -> Vec<[f64; 3]> {
    let moved = |p: &[f64; 3]| [p[0] + by[0], p[1] + by[1], p[2] + by[2]];
    points.iter().map(moved).collect()
}

/// A request that creates a session of a scene.
pub fn creation(scene: Scene) -> v1::CreateSessionRequest {
    v1::CreateSessionRequest {
        scene: Some(scene),
        ..v1::CreateSessionRequest::default()
    }
}
