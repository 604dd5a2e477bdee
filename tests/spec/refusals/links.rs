//! Links of each law, and motion that is imposed.

use sinew_proto::v1::{Indices, Links, Scene, links::Law};
use sinew_tests::scenes as posted;

use super::each;
use crate::{modules::each_law, particles::given};

fn links(scene: &mut Scene, batch: usize) -> &mut Links {
    &mut given(scene).links[batch]
}

/// Changes the law of a batch.
macro_rules! spoil {
    ($scene:ident, $batch:literal, $law:ident, $column:ident, $value:expr) => {
        match &mut links($scene, $batch).law {
            Some(Law::$law(law)) => law.$column = $value,
            other => panic!("{other:?}"),
        }
    };
}

fn one(value: f64) -> Option<sinew_proto::v1::Reals> {
    Some(posted::reals(&[value]))
}

macro_rules! at {
    ($field:literal) => {
        concat!("scene.motion.particles.", $field)
    };
}

#[test]
fn what_is_wrong_with_a_link_of_any_law_is_refused_by_its_path() {
    const RANGE: &str = "VALUE_OUT_OF_RANGE";
    each(
        each_law,
        &[
            (
                |s| spoil!(s, 0, Spring, stiffness, one(-1.0)),
                RANGE,
                at!("links[0].spring.stiffness[0]"),
            ),
            (
                |s| spoil!(s, 2, Spring, damping, one(-0.1)),
                RANGE,
                at!("links[2].spring.damping[0]"),
            ),
            (
                |s| spoil!(s, 3, Contact, rest_lengths, one(f64::NAN)),
                "VALUE_NOT_FINITE",
                at!("links[3].contact.rest_lengths[0]"),
            ),
            (
                |s| spoil!(s, 4, Breaking, elongations, one(-0.4)),
                RANGE,
                at!("links[4].breaking.elongations[0]"),
            ),
            (
                |s| spoil!(s, 4, Breaking, elongations, None),
                "LENGTH_MISMATCH",
                at!("links[4].breaking.elongations"),
            ),
            (
                |s| spoil!(s, 5, Plastic, yields, one(-0.1)),
                RANGE,
                at!("links[5].plastic.yields[0]"),
            ),
            (
                |s| spoil!(s, 6, Friction, stiffness, one(0.0)),
                RANGE,
                at!("links[6].friction.stiffness[0]"),
            ),
            (
                |s| spoil!(s, 6, Friction, limits, one(-3.0)),
                RANGE,
                at!("links[6].friction.limits[0]"),
            ),
            (
                |s| spoil!(s, 7, Table, lengths, Some(posted::reals(&[1.0, 0.9, 2.0]))),
                RANGE,
                at!("links[7].table.lengths[1]"),
            ),
            (
                |s| spoil!(s, 7, Table, forces, one(0.0)),
                "LENGTH_MISMATCH",
                at!("links[7].table.forces"),
            ),
        ],
    );
}

#[test]
fn links_and_paths_of_particles_that_are_not_there_are_refused_by_their_path() {
    each(
        each_law,
        &[
            (
                |s| links(s, 1).ends = Some(Indices::pack(&[0, 2])),
                "INDEX_OUT_OF_RANGE",
                at!("links[1].ends[0]"),
            ),
            (
                |s| links(s, 1).ends = Some(Indices::pack(&[1, 1])),
                "LINK_DEGENERATE",
                at!("links[1].ends[0]"),
            ),
            (
                |s| given(s).driven[0].particle = 2,
                "INDEX_OUT_OF_RANGE",
                at!("driven[0].particle"),
            ),
            (
                |s| given(s).driven[0].particle = 0,
                "PARTICLE_MOVED_TWICE",
                at!("driven[0].particle"),
            ),
            (
                |s| {
                    given(s).driven[0].path.as_mut().unwrap().times =
                        Some(posted::reals(&[1.0, 1.0]))
                },
                "VALUE_OUT_OF_RANGE",
                at!("driven[0].path.times[1]"),
            ),
        ],
    );
}
