//! From the wire to a scene: units and defaults. Forms are checked here, values in
//! [`sinew_engine::World::build`]; both name fields by their path in the request.

mod elastic;
mod mapping;
mod modules;
mod particles;
mod rule;

use nalgebra::Vector3;
use sinew_engine as engine;
use sinew_mesh::{Cells, Grid};
use sinew_proto::{ColumnError, v1};

use crate::{
    assets::Assets,
    error::{ServiceError, invalid},
    session::Drive,
};

/// Simulated time of a step of an internal model where the scene does not say, s.
const DEFAULT_TIME_STEP: f64 = 1.0 / 120.0;
/// Longest title, characters.
const TITLE: usize = 200;

use elastic::elastic;
pub(crate) use mapping::mapping;
pub(crate) use modules::selection;
use particles::{mass_spring, particles};

type Result<T, E = ServiceError> = std::result::Result<T, E>;

/// Reads a scene and how it is driven.
pub(crate) fn scene(scene: v1::Scene, assets: &Assets) -> Result<(engine::Scene, Drive)> {
    if scene.title.chars().count() > TITLE {
        let problem = format!("has {} characters", scene.title.chars().count());
        return Err(invalid(
            "TITLE_TOO_LONG",
            "scene.title",
            problem,
            format!("use at most {TITLE}"),
        ));
    }
    let source = scene
        .motion
        .and_then(|motion| motion.source)
        .ok_or_else(|| {
            missing(
                "scene.motion",
                "give `external`, `mass_spring`, `particles` or `elastic`",
            )
        })?;
    let pace = known::<v1::Pace>(scene.pace, "scene.pace")?;
    let (motion, default_step, drive) = match source {
        v1::motion::Source::External(points) => {
            let (points, rate) = external(points)?;
            (
                engine::Motion::External(points),
                1.0 / rate,
                Drive::External,
            )
        }
        v1::motion::Source::MassSpring(network) => (
            engine::Motion::MassSpring(Box::new(mass_spring(network)?)),
            DEFAULT_TIME_STEP,
            own_pace(pace),
        ),
        v1::motion::Source::Elastic(given) => (
            engine::Motion::Elastic(Box::new(elastic(given, assets)?)),
            DEFAULT_TIME_STEP,
            own_pace(pace),
        ),
        v1::motion::Source::Particles(given) => (
            engine::Motion::Particles(Box::new(particles(given)?)),
            DEFAULT_TIME_STEP,
            own_pace(pace),
        ),
    };
    let mesh = scene.mesh.unwrap_or_default();
    client_only("", mesh.file_unit_metres, "scene.mesh")?;
    let source = mesh.source.ok_or_else(|| missing("scene.mesh", SOURCES))?;
    let scene = engine::Scene {
        title: scene.title,
        motion,
        mesh: mesh_source(source, mesh.fill, assets)?,
        mapping: mapping(scene.mapping.unwrap_or_default())?,
        rules: (scene.rules.into_iter().enumerate())
            .map(|(i, rule)| rule::rule(i, rule))
            .collect::<Result<_>>()?,
        time_step: if scene.time_step_seconds == 0.0 {
            default_step
        } else {
            scene.time_step_seconds
        },
        up: match known::<v1::UpAxis>(scene.up, "scene.up")? {
            v1::UpAxis::Y => engine::UpAxis::Y,
            v1::UpAxis::Unspecified | v1::UpAxis::Z => engine::UpAxis::Z,
        },
        probes: (scene.probes.into_iter().enumerate())
            .map(|(i, given)| modules::probe(i, given))
            .collect::<Result<_>>()?,
    };
    Ok((scene, drive))
}

/// How a session keeps time that makes its own motion.
fn own_pace(pace: v1::Pace) -> Drive {
    match pace {
        v1::Pace::Unspecified | v1::Pace::RealTime => Drive::RealTime,
        v1::Pace::Unpaced => Drive::Unpaced,
    }
}

fn external(points: v1::ExternalPoints) -> Result<(engine::ExternalPoints, f64)> {
    const FIELD: &str = "scene.motion.external";
    client_only(&points.file, points.file_unit_metres, FIELD)?;
    let rate = points.rate_hz;
    if !(rate.is_finite() && rate > 0.0) {
        let field = format!("{FIELD}.rate_hz");
        return Err(invalid(
            "VALUE_OUT_OF_RANGE",
            field,
            format!("is {rate}"),
            "give the take's frames per second",
        ));
    }
    let rest = vectors(
        points.rest_positions.as_ref(),
        &format!("{FIELD}.rest_positions"),
    )?;
    let absent = indices(points.absent.as_ref(), &format!("{FIELD}.absent"))?;
    Ok((
        engine::ExternalPoints {
            labels: points.labels,
            rest,
            absent,
            tracking: tracking(points.tracking.unwrap_or_default()),
        },
        rate,
    ))
}

fn tracking(tracking: v1::Tracking) -> engine::Tracking {
    let v1::Tracking {
        predict_seconds,
        release_seconds,
        take_back_seconds,
        max_speed_change,
        believe_seconds,
    } = tracking;
    let default = engine::Tracking::default();
    engine::Tracking {
        predict_seconds: predict_seconds.unwrap_or(default.predict_seconds),
        release_seconds: release_seconds.unwrap_or(default.release_seconds),
        take_back_seconds: take_back_seconds.unwrap_or(default.take_back_seconds),
        max_speed_change: max_speed_change.unwrap_or(default.max_speed_change),
        believe_seconds: believe_seconds.unwrap_or(default.believe_seconds),
    }
}

fn mesh_source(
    source: v1::mesh::Source,
    fill: Option<v1::Fill>,
    assets: &Assets,
) -> Result<engine::MeshSource> {
    use v1::mesh::Source;
    let given = match source {
        Source::Grid(given) => given,
        Source::Asset(name) => prost::Message::decode(assets.get(&name)?)
            .map_err(|error| ServiceError::Garbled(format!("{name}: {error}")))?,
        Source::Lattice(given) => {
            if fill.is_some() {
                let problem = "fills a surface, and a lattice has none to fill";
                let remedy = "give the lattice or the filling of another source";
                return Err(invalid("CONFLICT", "scene.mesh.fill", problem, remedy));
            }
            return lattice(given).map(engine::MeshSource::Lattice);
        }
        Source::File(path) => {
            client_only(&path, 0.0, "scene.mesh")?;
            return Err(missing("scene.mesh", SOURCES));
        }
    };
    let grid = grid(given, "scene.mesh.grid")?;
    let Some(v1::Fill { shape, spacing }) = fill else {
        return Ok(engine::MeshSource::Grid(grid));
    };
    Ok(engine::MeshSource::Fill(engine::Fill {
        skin: grid,
        shape: cell_shape(shape, "scene.mesh.fill.shape")?,
        spacing,
    }))
}

/// Reads a grid; its structure and its geometry are checked by the engine.
fn grid(grid: v1::UnstructuredGrid, field: &str) -> Result<Grid> {
    let column =
        |given: Option<&v1::Indices>, name: &str| indices(given, &format!("{field}.{name}"));
    Ok(Grid {
        positions: vectors(grid.positions.as_ref(), &format!("{field}.positions"))?,
        cells: Cells {
            types: grid.cell_types.to_vec(),
            connectivity: column(grid.connectivity.as_ref(), "connectivity")?,
            offsets: column(grid.offsets.as_ref(), "offsets")?,
            faces: column(grid.faces.as_ref(), "faces")?,
            face_offsets: column(grid.face_offsets.as_ref(), "face_offsets")?,
        },
    })
}

fn cell_shape(shape: i32, field: &str) -> Result<engine::CellShape> {
    Ok(match known::<v1::CellShape>(shape, field)? {
        v1::CellShape::Hexahedron => engine::CellShape::Hexahedron,
        v1::CellShape::Unspecified | v1::CellShape::Tetrahedron => engine::CellShape::Tetrahedron,
    })
}

fn lattice(lattice: v1::Lattice) -> Result<engine::Lattice> {
    Ok(engine::Lattice {
        shape: cell_shape(lattice.shape, "scene.mesh.lattice.shape")?,
        spacing: lattice.spacing,
        radius: lattice.radius,
        bones: lattice
            .bones
            .into_iter()
            .map(|bone| engine::Bone {
                from: bone.from,
                to: bone.to,
                radius: if bone.radius == 0.0 {
                    lattice.radius
                } else {
                    bone.radius
                },
            })
            .collect(),
    })
}

fn missing(field: &str, remedy: &str) -> ServiceError {
    invalid("FIELD_MISSING", field, "is missing", remedy)
}

/// Where a mesh comes from.
const SOURCES: &str = "give `lattice`, `grid` or `asset`; in a scene file also `file`";

/// Refuses what only a client can resolve: `file` and `file_unit_metres` of `message`.
fn client_only(path: &str, unit: f64, message: &str) -> Result<()> {
    let (field, value) = if !path.is_empty() {
        ("file", path.to_owned())
    } else if unit != 0.0 {
        ("file_unit_metres", unit.to_string())
    } else {
        return Ok(());
    };
    Err(not_resolved(&format!("{message}.{field}"), &value))
}

/// A field that only clients understand.
fn not_resolved(field: &str, value: &str) -> ServiceError {
    let remedy = "the server reads no files; let the client resolve it, as `sinew run` does";
    invalid("FILE_NOT_RESOLVED", field, format!("is `{value}`"), remedy)
}

/// The index of the point of that label.
pub(crate) fn point(label: &str, labels: &[String], field: &str) -> Result<u32> {
    let found = (0..).zip(labels).find(|(_, known)| *known == label);
    let unknown = || {
        let problem = format!("is `{label}`, which no point has");
        let remedy = "use the labels of the scene's points";
        invalid("LABEL_UNKNOWN", field, problem, remedy)
    };
    found.map(|(point, _)| point).ok_or_else(unknown)
}

/// A number as the enum it stands for.
pub(crate) fn known<E: TryFrom<i32>>(number: i32, field: &str) -> Result<E> {
    E::try_from(number).map_err(|_| {
        invalid(
            "ENUM_UNKNOWN",
            field,
            format!("is {number}"),
            "use one of the values that the API names",
        )
    })
}

fn reals(column: Option<&v1::Reals>, field: &str) -> Result<Vec<f64>> {
    column
        .map_or(Ok(Vec::new()), v1::Reals::unpack)
        .map_err(|error| garbled(field, &error))
}

pub(crate) fn indices(column: Option<&v1::Indices>, field: &str) -> Result<Vec<u32>> {
    column
        .map_or(Ok(Vec::new()), v1::Indices::unpack)
        .map_err(|error| garbled(field, &error))
}

/// Reads positions or the like, 3 numbers each.
pub(crate) fn vectors(column: Option<&v1::Reals>, field: &str) -> Result<Vec<Vector3<f64>>> {
    let numbers = reals(column, field)?;
    let (triples, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        let problem = format!("has {} numbers", numbers.len());
        return Err(invalid(
            "LENGTH_MISMATCH",
            field,
            problem,
            "give x, y and z for each",
        ));
    }
    Ok(triples
        .iter()
        .map(|triple| Vector3::from(*triple))
        .collect())
}

fn garbled(field: &str, error: &ColumnError) -> ServiceError {
    invalid(
        "COLUMN_GARBLED",
        field,
        error.to_string(),
        "give one form, of whole numbers' length",
    )
}
