//! What mappings ask of the mesh's cells.

use nalgebra::Vector3;
use sinew_mapping::{Body, Cells, Graph, Mesh, Rows, Simplices};
use sinew_mesh::{Complex, Table};

use crate::{
    build::refuse,
    refusal::mapping_refusal,
    rest::Rest,
    scene::{Cost, Dimension, Geodesics, Mapping, Metric, Paths, Roots, SceneError},
};

const FLOOD: &str = "scene.mapping.weighting.flood";

/// The cells that a mapping asks for: nothing for one by distance at the vertices alone.
#[derive(Default)]
pub(crate) struct Asked {
    centres: Vec<Vector3<f64>>,
    at_vertices: Option<Rows>,
    graph: Option<Graph>,
    holding: Option<Rows>,
    inside: Option<Inside>,
}

/// What geodesics ask for.
struct Inside {
    simplices: Simplices,
    corners: Option<Rows>,
    holding: Option<Rows>,
}

impl Asked {
    /// # Errors
    /// [`SceneError`] where the mesh has not what the mapping asks for, or too much of it.
    pub(crate) fn new(rest: &Rest, mapping: &Mapping) -> Result<Self, SceneError> {
        let weighting = &mapping.recipe.weighting;
        let targets = weighting.targets;
        let mut asked = Self::default();
        let mut corners = None;
        if targets != Dimension::Vertex {
            let complex = rest.complex();
            let bounds = complex.bounds(cells_of(targets), sinew_mesh::Dimension::Vertex);
            asked.at_vertices = Some(rows(bounds.transposed(rest.vertices.len())));
            corners = Some(rows(bounds));
            asked.centres = complex.centres(cells_of(targets), &rest.vertices);
            if asked.centres.is_empty() {
                let problem = "are cells of which the mesh has none";
                let remedy = "choose cells that it has, or leave this out";
                let field = "scene.mapping.weighting.targets";
                return Err(refuse("MAPPING_REFUSED", field, problem, remedy));
            }
        }
        let mut holding = mapping.recipe.filter.needs_volumes();
        match &weighting.metric {
            Metric::Straight => {}
            Metric::Paths(paths) => {
                holding |= paths.roots == Roots::Containing;
                // The same cells are refused by the kernel.
                if paths.arcs != targets {
                    asked.graph = Some(graph(rest, mapping, targets, paths)?);
                }
            }
            Metric::Geodesics(geodesics) => {
                asked.inside = Some(inside(rest, mapping, geodesics, corners)?);
            }
        }
        if holding {
            let complex = rest.complex();
            let held = complex.holding(cells_of(targets), &rest.vertices, &rest.points);
            asked.holding = Some(rows(held));
        }
        Ok(asked)
    }

    /// `torn` says whether the mesh came apart since it was made, `may_change` whether it may yet.
    pub(crate) fn mesh<'a>(
        &'a self,
        vertices: &'a [Vector3<f64>],
        torn: bool,
        may_change: bool,
    ) -> Mesh<'a> {
        let body = |inside: &'a Inside| Body {
            simplices: &inside.simplices,
            corners: inside.corners.as_ref(),
            holding: inside.holding.as_ref(),
        };
        let cells = |at_vertices| Cells {
            centres: &self.centres,
            at_vertices,
        };
        Mesh {
            vertices,
            cells: self.at_vertices.as_ref().map(cells),
            graph: self.graph.as_ref(),
            body: self.inside.as_ref().map(body),
            holding: self.holding.as_ref(),
            torn,
            may_change,
        }
    }
}

/// What geodesics go through. `[W12]`
fn inside(
    rest: &Rest,
    mapping: &Mapping,
    geodesics: &Geodesics,
    corners: Option<Rows>,
) -> Result<Inside, SceneError> {
    let complex = rest.complex();
    let (tetrahedra, triangles) = complex.simplices();
    let simplices = Simplices::new(&rest.vertices, &tetrahedra, &triangles);
    let holding = (geodesics.roots == Roots::Containing).then(|| {
        let vertices = sinew_mesh::Dimension::Vertex;
        rows(complex.holding(vertices, &rest.vertices, &rest.points))
    });
    Ok(Inside {
        simplices: simplices.map_err(|error| mapping_refusal(mapping, &error))?,
        corners,
        holding,
    })
}

/// What a flood spreads over. `[W7]`
fn graph(
    rest: &Rest,
    mapping: &Mapping,
    targets: Dimension,
    paths: &Paths,
) -> Result<Graph, SceneError> {
    let complex = rest.complex();
    let (nodes, arcs) = (cells_of(targets), cells_of(paths.arcs));
    let neighbours = (complex.neighbours(nodes, arcs)).map_err(|error| SceneError {
        reason: "MAPPING_REFUSED",
        field: format!("{FLOOD}.arcs"),
        message: error.to_string(),
    })?;
    let costs = costs(complex, nodes, &rest.vertices, neighbours, &paths.cost)?;
    let graph = Graph::new(rows(neighbours.clone()), costs);
    graph.map_err(|error| mapping_refusal(mapping, &error))
}

/// What an arc between two vertices costs, where that can be told without a look at all others.
pub(crate) enum ArcCost<'a> {
    Hop,
    Length(&'a [Vector3<f64>]),
    Column(&'a [f64]),
}

/// How arcs between vertices are priced one by one; `None` where their costs compare with the whole mesh.
pub(crate) fn cost_between<'a>(
    cost: &'a Cost,
    vertices: &'a [Vector3<f64>],
) -> Option<ArcCost<'a>> {
    match cost {
        Cost::Hops => Some(ArcCost::Hop),
        Cost::Length => Some(ArcCost::Length(vertices)),
        Cost::Column(column) => (column.len() == vertices.len()).then_some(ArcCost::Column(column)),
        Cost::Volume | Cost::Curvature(_) => None,
    }
}

impl ArcCost<'_> {
    /// `None` where all cost 1.
    pub(crate) fn of(&self, a: u32, b: u32) -> Option<f64> {
        let [a, b] = [a, b].map(|vertex| vertex as usize);
        match self {
            Self::Hop => None,
            Self::Length(places) => Some((places[a] - places[b]).norm()),
            Self::Column(column) => Some(0.5 * (column[a] + column[b])),
        }
    }
}

/// One per neighbour of each node; none where each costs 1.
fn costs(
    complex: &Complex,
    nodes: sinew_mesh::Dimension,
    vertices: &[Vector3<f64>],
    neighbours: &Table,
    cost: &Cost,
) -> Result<Vec<f64>, SceneError> {
    let centres = || complex.centres(nodes, vertices);
    let length = |centres: &[Vector3<f64>], a: usize, b: usize| (centres[a] - centres[b]).norm();
    let mean = |column: &[f64]| each(neighbours, |a, b| 0.5 * (column[a] + column[b]));
    Ok(match cost {
        Cost::Hops => Vec::new(),
        Cost::Length => {
            let centres = centres();
            each(neighbours, |a, b| length(&centres, a, b))
        }
        Cost::Volume => {
            let Some(sizes) = complex.sizes(nodes, vertices) else {
                let problem = "asks for volumes, of which the mesh has none";
                let remedy = "choose the cost `length`, or give a column";
                let field = format!("{FLOOD}.volume");
                return Err(refuse("MAPPING_REFUSED", field, problem, remedy));
            };
            mean(&sizes)
        }
        &Cost::Curvature(metres_per_radian) => {
            check(&[metres_per_radian], |_| {
                format!("{FLOOD}.curvature.metres_per_radian")
            })?;
            let (centres, normals) = (centres(), complex.normals(nodes, vertices));
            each(neighbours, |a, b| {
                let turn = normals[a].angle(&normals[b]); // 0 where one has none
                length(&centres, a, b) + metres_per_radian * turn // [W10]
            })
        }
        Cost::Column(column) => {
            if column.len() != complex.count(nodes) {
                let count = complex.count(nodes);
                let problem = format!("has {} numbers for {count} targets", column.len());
                let field = format!("{FLOOD}.column");
                return Err(refuse(
                    "LENGTH_MISMATCH",
                    field,
                    problem,
                    "give one for each",
                ));
            }
            check(column, |entry| format!("{FLOOD}.column[{entry}]"))?;
            mean(column)
        }
    })
}

fn check(column: &[f64], field: impl Fn(usize) -> String) -> Result<(), SceneError> {
    let bad = |value: &f64| !(0.0..=1e100).contains(value);
    match column.iter().position(bad) {
        None => Ok(()),
        Some(entry) => Err(refuse(
            "VALUE_OUT_OF_RANGE",
            field(entry),
            format!("is {}", column[entry]),
            "give a number from 0 to 1e100",
        )),
    }
}

/// A number for each neighbour of each node.
fn each(neighbours: &Table, of: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let rows = neighbours.rows().enumerate();
    rows.flat_map(|(node, row)| row.iter().map(move |&other| (node, other as usize)))
        .map(|(node, other)| of(node, other))
        .collect()
}

fn rows(Table { starts, items }: Table) -> Rows {
    Rows::new(starts, items)
}

pub(crate) fn cells_of(dimension: Dimension) -> sinew_mesh::Dimension {
    match dimension {
        Dimension::Vertex => sinew_mesh::Dimension::Vertex,
        Dimension::Edge => sinew_mesh::Dimension::Edge,
        Dimension::Face => sinew_mesh::Dimension::Face,
        Dimension::Volume => sinew_mesh::Dimension::Volume,
    }
}
#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::Value;
    use sinew_mesh::shapes;

    use super::*;
    use crate::scene::{Filter, Kernel, Recipe, Reference, Rule, Start, Weighting};

    const DIMENSIONS: [Dimension; 4] = [
        Dimension::Vertex,
        Dimension::Edge,
        Dimension::Face,
        Dimension::Volume,
    ];

    /// Distances of every target from every point; of the first point alone, sorted, where the golden has no more.
    fn found(case: &Value, rest: &Rest) -> Value {
        let given = &case["in"];
        let dimension = |name: &str| {
            let number = serde_json::from_value::<usize>(given[name].clone());
            DIMENSIONS[number.unwrap_or(0)]
        };
        let paths = Paths {
            arcs: dimension("arc_dim"),
            roots: match given["root"].as_str() {
                Some("containing") => Roots::Containing,
                _ => Roots::Nearest,
            },
            start: Start::Zero,
            cost: match given["hybrid"].as_str() {
                Some("length") => Cost::Length,
                _ => Cost::Hops,
            },
        };
        let mapping = Mapping {
            recipe: Recipe {
                weighting: Weighting {
                    metric: match given["kind"].as_str() {
                        Some("topological") => Metric::Paths(paths),
                        _ => Metric::Straight,
                    },
                    targets: dimension("node_dim"),
                    kernel: Kernel::Gaussian,
                    ..Weighting::default()
                },
                filter: Filter::KeepK(1),
                rule: Rule::WeightedMean,
                reference: Reference::Initial,
            },
            points: Vec::new(),
        };
        let asked = Asked::new(rest, &mapping).unwrap();
        let mesh = asked.mesh(&rest.vertices, false, false);
        let weighting = &mapping.recipe.weighting;
        let nearest = sinew_mapping::distances(&mesh, &rest.points, &rest.present, weighting);
        let nearest = nearest.unwrap();
        let targets = rest.complex().count(cells_of(weighting.targets));
        if case["out"].get("sorted_counts").is_some() {
            let hops = |target| nearest.row(target).next().unwrap().1;
            let at = |hop: u32| {
                let there = |&target: &usize| hops(target) == f64::from(hop);
                (0..targets).filter(there).count()
            };
            let counts: Vec<usize> = (0..9).map(at).collect();
            return serde_json::json!({ "sorted_counts": counts });
        }
        let mut rows = vec![vec![f64::INFINITY; rest.points.len()]; targets];
        for (target, row) in rows.iter_mut().enumerate() {
            for (point, distance) in nearest.row(target) {
                row[point as usize] = distance;
            }
        }
        serde_json::json!({ "W": rows })
    }

    #[test]
    fn distances_agree_with_the_golden() {
        let golden: Value =
            serde_json::from_str(include_str!("../tests/data/C02_weights.json")).unwrap();
        let grid = shapes::tetrahedra(2, 2, 2);
        // The golden numbers vertices along z first.
        let turned = |x: &Vector3<f64>| Vector3::new(x.z, x.y, x.x);
        for case in golden["cases"].as_array().unwrap() {
            let points: Vec<[f64; 3]> =
                serde_json::from_value(case["in"]["particles"].clone()).unwrap();
            let rest = Rest::new(
                Vec::new(),
                points.iter().copied().map(Vector3::from).collect(),
                vec![true; points.len()],
                grid.positions.iter().map(turned).collect(),
                &Arc::new(grid.cells.clone()),
            );
            let found = found(case, &rest);
            let expected = &case["out"];
            if let Some(counts) = expected.get("sorted_counts") {
                assert_eq!(&found["sorted_counts"], counts);
                continue;
            }
            let numbers = |value: &Value| -> Vec<f64> {
                let rows: Vec<Vec<f64>> = serde_json::from_value(value["W"].clone()).unwrap();
                rows.concat()
            };
            let (found, expected) = (numbers(&found), numbers(expected));
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-11, "{}", case["in"]);
            }
        }
    }

    #[test]
    fn geodesics_of_targets_of_any_kind_in_a_convex_mesh_are_straight() {
        let points = vec![
            Vector3::new(0.31, 0.22, 0.57),
            Vector3::new(0.9, 0.41, 0.13),
        ];
        for grid in [shapes::tetrahedra(6, 6, 6), shapes::hexahedra(6, 6, 6)] {
            let rest = Rest::new(
                Vec::new(),
                points.clone(),
                vec![true; points.len()],
                grid.positions.clone(),
                &Arc::new(grid.cells.clone()),
            );
            for targets in DIMENSIONS {
                let mapping = Mapping {
                    recipe: Recipe {
                        weighting: Weighting {
                            metric: Metric::Geodesics(Geodesics {
                                roots: Roots::Containing,
                                start: Start::Distance,
                            }),
                            targets,
                            ..Weighting::default()
                        },
                        filter: Filter::KeepK(8),
                        rule: Rule::WeightedMean,
                        reference: Reference::Initial,
                    },
                    points: Vec::new(),
                };
                let asked = Asked::new(&rest, &mapping).unwrap();
                let mesh = asked.mesh(&rest.vertices, false, false);
                let weighting = &mapping.recipe.weighting;
                let found = sinew_mapping::distances(&mesh, &rest.points, &rest.present, weighting);
                let found = found.unwrap();
                let centres = (rest.complex()).centres(cells_of(targets), &rest.vertices);
                for (target, centre) in centres.iter().enumerate() {
                    assert_eq!(found.row(target).count(), 2);
                    for (point, distance) in found.row(target) {
                        let straight = (centre - points[point as usize]).norm();
                        let error = (distance - straight).abs();
                        // Near a point a corner may be off by part of a cell.
                        assert!(error < 0.06 + 0.01 * straight, "{targets:?}: {error}");
                    }
                }
            }
        }
    }
}
