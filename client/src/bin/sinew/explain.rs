//! Why a vertex is where it is, in words.

use sinew_proto::v1::{Cluster, Explanation, Reference, Vector3};

use crate::table::{Table, count};

/// Two lines on the vertex, then its points in a table.
pub(crate) fn explained(explanation: &Explanation) -> String {
    let Explanation {
        vertex,
        rest_position,
        position,
        step,
        points,
        rule,
        cluster,
        mapping_step,
        reference: _,
        topology_step,
    } = explanation;
    let from = match explanation.reference() {
        Reference::Unspecified | Reference::Initial => "",
        Reference::Previous => ", from the last pose",
    };
    let mut table = Table::of_numbers();
    table.row(["point", "index", "weight", "rest distance"]);
    for point in points {
        table.row([
            point.label.clone(),
            point.index.to_string(),
            format!("{:.4}", point.weight),
            format!("{:.4} m", point.rest_distance),
        ]);
    }
    let with = cluster.as_ref().map_or_else(String::new, |cluster| {
        let Cluster {
            first_vertex,
            vertex_count,
        } = cluster;
        let vertices = count(u64::from(*vertex_count));
        format!(", in the cluster of vertex {first_vertex}, {vertices} vertices")
    });
    let torn = topology_step.map_or_else(String::new, |step| {
        format!("its cells changed last at step {}\n", count(step))
    });
    format!(
        "vertex {vertex} is at {} m at step {}, at rest {} m\n{rule}{from} since step {}{with}\n{torn}\n{table}",
        place(position.as_ref()),
        count(*step),
        place(rest_position.as_ref()),
        count(*mapping_step),
    )
}

fn place(position: Option<&Vector3>) -> String {
    let Vector3 { x, y, z } = position.copied().unwrap_or_default();
    format!("({x:.4}, {y:.4}, {z:.4})")
}

#[cfg(test)]
mod tests {
    use sinew_proto::v1::Influence;

    use super::*;

    #[test]
    fn an_explanation_names_the_points_and_what_they_do() {
        let at = |x| Some(Vector3 { x, y: 0.0, z: 1.0 });
        let influence = |label: &str, index, weight, rest_distance| Influence {
            label: label.to_owned(),
            index,
            weight,
            rest_distance,
        };
        let explanation = Explanation {
            vertex: 42,
            rest_position: at(0.0),
            position: at(0.25),
            step: 1234,
            points: vec![
                influence("LKNE", 7, 0.75, 0.031),
                influence("LANK", 11, 0.25, 0.22),
            ],
            rule: "shape_matching".to_owned(),
            cluster: Some(Cluster {
                first_vertex: 3,
                vertex_count: 1064,
            }),
            mapping_step: 600,
            reference: Reference::Initial.into(),
            topology_step: Some(1100),
        };
        assert_eq!(
            explained(&explanation),
            "vertex 42 is at (0.2500, 0.0000, 1.0000) m at step 1,234, at rest (0.0000, 0.0000, 1.0000) m\n\
             shape_matching since step 600, in the cluster of vertex 3, 1,064 vertices\n\
             its cells changed last at step 1,100\n\
             \n\
             point  index  weight  rest distance\n\
             LKNE       7  0.7500       0.0310 m\n\
             LANK      11  0.2500       0.2200 m\n"
        );
    }
}
