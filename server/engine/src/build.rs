//! From a scene to a world: all checks of a scene are here or in the kernels' constructors that this
//! calls.

use std::{collections::BTreeMap, fmt::Display, sync::Arc};

use nalgebra::{UnitQuaternion, Vector3};
use sinew_capture::Tracker;
use sinew_mesh::{Capsule, Grid, GridError, Inspection};
use sinew_tearing::Body;

use crate::{
    frame::{Frame, Layout, PointState},
    modules,
    particles::{Form, system_points},
    rest::Rest,
    rule::Action,
    rules::Rules,
    scene::{ExternalPoints, Fill, Lattice, MeshSource, Motion, Scene, SceneError},
    topology::Topology,
    world::{LIMIT, Source, World, first_out_of_range},
};

/// Cells named in one refusal; more are counted.
const NAMED: usize = 8;
const REPAIR: &str = "repair it, for example with `sinew inspect --repair`";

/// A day: time stays finite for any number of steps that anyone takes, s.
const LONGEST_STEP: f64 = 86_400.0;

const EXTERNAL: &str = "scene.motion.external";

/// The points as a scene gives them.
pub(crate) struct Points {
    pub(crate) source: Source,
    pub(crate) labels: Vec<String>,
    pub(crate) rest: Vec<Vector3<f64>>,
    pub(crate) orientations: Vec<UnitQuaternion<f64>>,
    pub(crate) states: Vec<PointState>,
    pub(crate) warnings: Vec<String>,
}

impl World {
    /// Builds a world. This is the only validation of a scene: what builds, steps.
    ///
    /// # Errors
    /// [`SceneError`] for the first thing that is wrong.
    pub fn build(scene: Scene) -> Result<World, SceneError> {
        let Scene {
            title: _,
            motion,
            mesh,
            mapping,
            rules,
            time_step,
            up: _,
            probes,
        } = scene;
        check_time_step(time_step)?;
        let mut points = moving(motion, time_step)?;
        let (probes, readings) = modules::find(&probes, &points.source)?;
        let grid = mesh_grid(mesh, &mut points)?;
        let acts = rules.iter().any(|rule| rule.action != Action::Report);
        let (grid, topology) = match acts {
            true => body(grid, &mut points.warnings)?,
            false => (grid, None),
        };
        let cells = Arc::new(grid.cells);
        let seen = |state: &PointState| *state != PointState::Absent;
        let present = points.states.iter().map(seen).collect();
        let mut rest = Rest::new(points.labels, points.rest, present, grid.positions, &cells);
        rest.may_change = topology.is_some();
        let bound = rest.bind(mapping)?;
        let layout = Arc::new(Layout {
            epoch: 1,
            topology_version: 0,
            hash: cells.hash(),
            dominant: bound.binding.dominant().to_vec(),
            cells,
        });
        let rules = (!rules.is_empty()).then(|| {
            let scale = bound.scale(&layout.cells, &rest);
            let weighting = &bound.mapping.recipe.weighting;
            Rules::new(rules, &rest, &scale, weighting).map(Box::new)
        });
        let rules = rules.transpose()?;
        let frame = Frame {
            layout: Arc::clone(&layout),
            sequence: 0,
            step: 0,
            time_seconds: 0.0,
            capture_time_seconds: None,
            motion_sequence: None,
            points: rest.points.to_vec(),
            orientations: points.orientations,
            point_states: points.states,
            doubts: Vec::new(),
            vertices: rest.vertices.clone(),
            measures: Vec::new(),
            readings,
            change: None,
        };
        Ok(World {
            source: points.source,
            probes,
            rest: Arc::new(rest),
            bound,
            blend: None,
            rules,
            topology,
            changed_at_step: 0,
            layout,
            time_step,
            warnings: points.warnings,
            frame: Arc::new(frame),
            retired: Vec::new(),
        })
    }
}

fn moving(motion: Motion, time_step: f64) -> Result<Points, SceneError> {
    match motion {
        Motion::External(points) => external(points, time_step),
        Motion::MassSpring(spec) => system_points(*spec, Form::MassSpring, time_step),
        Motion::Elastic(spec) => system_points(*spec, Form::Elastic, time_step),
        Motion::Particles(spec) => system_points(*spec, Form::Particles, time_step),
    }
}

fn mesh_grid(mesh: MeshSource, points: &mut Points) -> Result<Grid, SceneError> {
    match mesh {
        MeshSource::Grid(grid) => checked(grid, &mut points.warnings),
        MeshSource::Lattice(lattice) => lattice_grid(&lattice, points),
        MeshSource::Fill(fill) => filled(fill),
    }
}

fn filled(fill: Fill) -> Result<Grid, SceneError> {
    fill.skin.check().map_err(|error| grid_refusal(&error))?;
    sinew_mesh::fill(fill.shape, fill.spacing, &fill.skin)
        .map_err(|error| kernel_refusal("FILL_REFUSED", "scene.mesh.fill", &error))
}

fn check_time_step(time_step: f64) -> Result<(), SceneError> {
    if time_step > 0.0 && time_step <= LONGEST_STEP {
        return Ok(());
    }
    Err(refuse(
        "VALUE_OUT_OF_RANGE",
        "scene.time_step_seconds",
        format!("is {time_step}"),
        format!("give seconds above 0, at most {LONGEST_STEP}"),
    ))
}

/// Makes a mesh one that can change; where it is no manifold it comes apart for that.
fn body(
    mesh: Grid,
    warnings: &mut Vec<String>,
) -> Result<(Grid, Option<Box<Topology>>), SceneError> {
    let (body, report) =
        Body::new(mesh).map_err(|error| kernel_refusal("MESH_NOT_A_BODY", "scene.mesh", &error))?;
    let split = report.build.split_vertices.len();
    if split > 0 {
        warnings.push(format!(
            "the mesh came apart at {split} vertices where its parts touch without a face in common"
        ));
    }
    let grid = Grid {
        positions: body.rest().to_vec(),
        cells: body.cells(),
    };
    Ok((grid, Some(Box::new(Topology::new(body)))))
}

fn external(points: ExternalPoints, time_step: f64) -> Result<Points, SceneError> {
    let ExternalPoints {
        labels,
        mut rest,
        absent,
        tracking,
    } = points;
    if labels.is_empty() {
        return Err(refuse(
            "FIELD_MISSING",
            format!("{EXTERNAL}.labels"),
            "is empty",
            "name at least one point",
        ));
    }
    if rest.len() != labels.len() {
        let problem = format!("has {} positions for {} labels", rest.len(), labels.len());
        let field = format!("{EXTERNAL}.rest_positions");
        return Err(refuse(
            "LENGTH_MISMATCH",
            field,
            problem,
            "give one position for each label",
        ));
    }
    check_labels(&labels)?;
    let mut states = vec![PointState::Valid; labels.len()];
    for (i, point) in absent.iter().enumerate() {
        let state = states.get_mut(*point as usize).ok_or_else(|| {
            let problem = format!("is {point}, and there are {} points", labels.len());
            refuse(
                "INDEX_OUT_OF_RANGE",
                format!("{EXTERNAL}.absent[{i}]"),
                problem,
                "give the index of a point",
            )
        })?;
        *state = PointState::Absent;
    }
    for (i, (position, state)) in rest.iter_mut().zip(&states).enumerate() {
        if *state == PointState::Absent {
            *position = Vector3::zeros();
        } else if !position.iter().all(|x| x.is_finite()) {
            return Err(refuse(
                "VALUE_NOT_FINITE",
                format!("{EXTERNAL}.rest_positions[{i}]"),
                format!("is {:?} (point `{}`)", position.as_slice(), labels[i]),
                "give finite metres, or list the point in `absent`",
            ));
        }
    }
    in_range(&rest, &format!("{EXTERNAL}.rest_positions"))?;
    let present: Vec<bool> = (states.iter())
        .map(|state| *state != PointState::Absent)
        .collect();
    let tracker = Tracker::new(&rest, &present, time_step, tracking).map_err(|error| {
        refuse(
            "VALUE_OUT_OF_RANGE",
            format!("{EXTERNAL}.tracking.{}", error.field),
            format!("is {}", error.value),
            format!("give at least {}", error.least),
        )
    })?;
    Ok(Points {
        source: Source::External(Box::new(tracker)),
        labels,
        rest,
        orientations: Vec::new(),
        states,
        warnings: Vec::new(),
    })
}

/// Labels name points: none empty, none twice.
fn check_labels(labels: &[String]) -> Result<(), SceneError> {
    let mut seen = BTreeMap::new();
    for (i, label) in labels.iter().enumerate() {
        let field = || format!("{EXTERNAL}.labels[{i}]");
        if label.is_empty() {
            return Err(refuse(
                "LABEL_EMPTY",
                field(),
                "is empty",
                "name every point",
            ));
        }
        if let Some(first) = seen.insert(label, i) {
            let problem = format!("is `{label}`, like labels[{first}]");
            return Err(refuse(
                "LABEL_DUPLICATE",
                field(),
                problem,
                "name every point differently",
            ));
        }
    }
    Ok(())
}

/// Refuses a mesh that cannot be deformed, and warns of what can but looks like a mistake.
fn checked(grid: Grid, warnings: &mut Vec<String>) -> Result<Grid, SceneError> {
    grid.check().map_err(|error| grid_refusal(&error))?;
    in_range(&grid.positions, "scene.mesh.grid.positions")?;
    let found = sinew_mesh::inspect(&grid);
    let volumetric = found.counts.iter().any(|(kind, _)| kind.is_volume());
    if volumetric && found.inside_out {
        let problem = "is inside-out: most cells have a negative volume";
        return Err(refuse("CELL_INVERTED", "scene.mesh.grid", problem, REPAIR));
    }
    let bad_cells = [
        (&found.inverted_cells, "inverted", "CELL_INVERTED"),
        (&found.zero_volume_cells, "zero-volume", "CELL_ZERO_VOLUME"),
        (
            &found.repeated_vertex_cells,
            "degenerate (a vertex twice)",
            "CELL_ZERO_VOLUME",
        ),
        (&found.open_polyhedra, "open polyhedral", "CELL_OPEN"),
    ];
    for (ids, what, reason) in bad_cells {
        if !ids.is_empty() {
            let problem = format!("has {} {what} cells: {}", ids.len(), named(ids));
            return Err(refuse(reason, "scene.mesh.grid", problem, REPAIR));
        }
    }
    warn(&found, warnings);
    Ok(grid)
}

/// What can be deformed but looks like a mistake.
fn warn(found: &Inspection, warnings: &mut Vec<String>) {
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            warnings.push(format!("the mesh has {count} {what}"));
        }
    };
    note(found.unused_vertices.len(), "vertices of no cell");
    note(
        found.duplicate_vertices.len(),
        "vertices at the place of another",
    );
    note(found.duplicate_cells.len(), "cells like another");
    note(
        found.non_manifold_faces.len(),
        "faces of more than two volumes",
    );
    note(found.zero_area_cells.len(), "surface cells without area");
}

fn lattice_grid(lattice: &Lattice, points: &Points) -> Result<Grid, SceneError> {
    const FIELD: &str = "scene.mesh.lattice";
    let find = |label: &str, field: String| {
        let found = points.labels.iter().position(|known| known == label);
        let Some(i) = found else {
            return Err(refuse(
                "LABEL_UNKNOWN",
                field,
                format!("is `{label}`, which no point has"),
                "use a point's label",
            ));
        };
        if points.states[i] == PointState::Absent {
            let problem = format!("is `{label}`, which has no rest position");
            return Err(refuse(
                "POINT_ABSENT",
                field,
                problem,
                "leave this bone out",
            ));
        }
        Ok(points.rest[i])
    };
    let mut solid = Vec::new();
    for (i, bone) in lattice.bones.iter().enumerate() {
        let field = |end: &str| format!("{FIELD}.bones[{i}].{end}");
        if !(bone.radius.is_finite() && bone.radius > 0.0) {
            let problem = format!("is {}", bone.radius);
            return Err(refuse(
                "VALUE_OUT_OF_RANGE",
                field("radius"),
                problem,
                "give a positive number of metres",
            ));
        }
        let (start, end) = (
            find(&bone.from, field("from"))?,
            find(&bone.to, field("to"))?,
        );
        solid.push(Capsule {
            start,
            end,
            radius: bone.radius,
        });
    }
    if lattice.bones.is_empty() {
        let present = points
            .rest
            .iter()
            .zip(&points.states)
            .filter(|(_, state)| **state != PointState::Absent);
        solid.extend(present.map(|(at, _)| Capsule {
            start: *at,
            end: *at,
            radius: lattice.radius,
        }));
    }
    sinew_mesh::lattice(lattice.shape, lattice.spacing, &solid)
        .map_err(|error| kernel_refusal("LATTICE_REFUSED", FIELD, &error))
}

fn grid_refusal(error: &GridError) -> SceneError {
    let reason = if matches!(error, GridError::IndexOutOfRange { .. }) {
        "INDEX_OUT_OF_RANGE"
    } else if matches!(error, GridError::NotFinite { .. }) {
        "VALUE_NOT_FINITE"
    } else {
        "MESH_MALFORMED"
    };
    kernel_refusal(reason, "scene.mesh.grid", error)
}

/// The kernels' errors name the value and the remedy themselves.
pub(crate) fn kernel_refusal(
    reason: &'static str,
    field: impl Into<String>,
    error: &dyn std::error::Error,
) -> SceneError {
    SceneError {
        reason,
        field: field.into(),
        message: error.to_string(),
    }
}

pub(crate) fn in_range(positions: &[Vector3<f64>], field: &str) -> Result<(), SceneError> {
    let Some(i) = first_out_of_range(positions) else {
        return Ok(());
    };
    Err(refuse(
        "VALUE_OUT_OF_RANGE",
        format!("{field}[{i}]"),
        format!("is {:?}", positions[i].as_slice()),
        format!("give metres below {LIMIT:e}"),
    ))
}

fn named(ids: &[u32]) -> String {
    let list: Vec<String> = ids.iter().take(NAMED).map(u32::to_string).collect();
    let more = if ids.len() > NAMED { ", …" } else { "" };
    format!("{}{more}", list.join(", "))
}

pub(crate) fn refuse(
    reason: &'static str,
    field: impl Into<String>,
    problem: impl Display,
    remedy: impl Display,
) -> SceneError {
    SceneError {
        reason,
        field: field.into(),
        message: format!("{problem}; {remedy}"),
    }
}
