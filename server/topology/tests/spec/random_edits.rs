//! No sequence of edits breaks a map.

use proptest::prelude::*;
use sinew_mesh::shapes;
use sinew_topology::{
    AnyCell, Cell, Changes, Dart, Edge, Edit, EditError, Event, Face, Kind, Map, Place, Vertex,
    Volume,
};

use crate::shapes::map_of;

/// One edit, aimed by numbers at whatever the map has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shot {
    kind: u8,
    at: usize,
    other: usize,
}

fn pick_dart(map: &Map, at: usize) -> Option<Dart> {
    let slots = map.dart_slot_count();
    (0..slots).find_map(|step| map.dart_at((at + step) % slots))
}

/// A dart whose β3 is free, like those of as long a face as the first's.
fn partner(map: &Map, dart: Dart, at: usize) -> Option<Dart> {
    let slots = map.dart_slot_count();
    let length = map.ring(dart).count();
    let fits = |&other: &Dart| map.beta3(other).is_none() && map.ring(other).count() == length;
    (0..slots)
        .filter_map(|step| map.dart_at((at + step) % slots))
        .find(fits)
}

fn shoot(edit: &mut Edit<'_>, shot: Shot) -> Result<(), EditError> {
    let Shot { kind, at, other } = shot;
    let map = edit.map();
    let (Some(dart), Some(second)) = (pick_dart(map, at), pick_dart(map, other)) else {
        edit.add_volume(&[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]])?;
        return Ok(());
    };
    match kind % 16 {
        0 | 1 => edit.unsew3(dart).map(drop),
        2 | 3 => {
            let other = partner(map, dart, other).unwrap_or(second);
            edit.sew3(dart, other)
        }
        4 => edit.split_edge(map.edge(dart)).map(drop),
        5 => {
            let to = map.ring(dart).nth(2 + other % 3).unwrap_or(second);
            edit.split_face(dart, to).map(drop)
        }
        6 => {
            let place = |vertex: Cell<Vertex>| match (vertex.index() * 7919 + other) % 5 {
                0 | 1 => Place::Below,
                2 => Place::On,
                _ => Place::Above,
            };
            let volume = map.volume(dart);
            edit.cut(&[volume], place).map(drop)
        }
        7 => edit.star(map.volume(dart)).map(drop),
        8 => edit.star_face(map.face(dart)).map(drop),
        9 => edit.bisect(map.edge(dart)).map(drop),
        10 | 11 => edit.collapse(map.edge(dart), map.vertex(dart)),
        12 => edit.remove_volume(map.volume(dart)),
        13 => edit.split_hexahedra(&[map.volume(dart)]),
        14 => {
            // Links alone, undone, turned or left open; what stays must settle.
            let facing = edit.unlink3(dart)?;
            match other % 3 {
                0 => edit.link3(dart, facing),
                1 => {
                    let turned = edit.map().beta1(facing);
                    edit.link3(dart, turned)
                }
                _ => Ok(()),
            }
        }
        _ => {
            // An open volume is refused when the edit ends, unless it is closed again.
            let across = edit.unsew2(dart)?;
            if other.is_multiple_of(3) {
                Ok(())
            } else {
                edit.sew2(dart, across)
            }
        }
    }
}

/// Where a map starts, and is brought back to when it has grown or shrunk too far.
fn seed_map(number: usize) -> Map {
    map_of(&match number % 5 {
        0 => shapes::tetrahedra(2, 1, 1),
        1 => shapes::hexahedra(2, 2, 1),
        2 => crate::shapes::two_tetrahedra(),
        3 => crate::shapes::sheet(3, 2),
        _ => crate::shapes::hollow_tetrahedron(),
    })
}

/// Columns of what lives, kept up by events alone.
struct Ledger {
    alive: [Vec<bool>; 4],
}

impl Ledger {
    fn new(map: &Map) -> Self {
        fn of<K: Kind>(map: &Map) -> Vec<bool> {
            (0..map.slot_count::<K>())
                .map(|slot| map.cell_at::<K>(slot).is_some())
                .collect()
        }
        Self {
            alive: [
                of::<Vertex>(map),
                of::<Edge>(map),
                of::<Face>(map),
                of::<Volume>(map),
            ],
        }
    }

    fn follow(&mut self, changes: &Changes) {
        for event in &changes.events {
            let (cell, lives) = match event {
                Event::Born { cell, .. } => (cell, true),
                Event::Died { cell, .. } => (cell, false),
            };
            let (dimension, slot) = match *cell {
                AnyCell::Vertex(cell) => (0, cell.index()),
                AnyCell::Edge(cell) => (1, cell.index()),
                AnyCell::Face(cell) => (2, cell.index()),
                AnyCell::Volume(cell) => (3, cell.index()),
            };
            let column = &mut self.alive[dimension];
            if column.len() <= slot {
                column.resize(slot + 1, false);
            }
            assert_ne!(column[slot], lives, "{cell} comes or goes twice");
            column[slot] = lives;
        }
    }
}

/// Returns how many edits were made, and how many refused.
fn run(map: &mut Map, shots: &[Shot]) -> [usize; 2] {
    let mut ledger = Ledger::new(map);
    let mut count = [0, 0];
    for &shot in shots {
        let before = map.digest();
        match map.edit(|edit| shoot(edit, shot)) {
            Ok(((), changes)) => {
                count[0] += 1;
                ledger.follow(&changes);
                assert_eq!(ledger.alive, Ledger::new(map).alive, "after {shot:?}");
            }
            Err(error) => {
                count[1] += 1;
                assert_eq!(map.digest(), before, "{shot:?} was refused: {error}");
            }
        }
        assert_eq!(map.violations(), [], "after {shot:?}");
        if map.slot_count::<Vertex>() > 2000 {
            map.reclaim();
        }
        if map.dart_count() > 2000 {
            *map = seed_map(shot.at);
            ledger = Ledger::new(map);
        }
    }
    count
}

fn any_shot() -> impl Strategy<Value = Shot> {
    (any::<u8>(), 0..100_000usize, 0..100_000usize).prop_map(|(kind, at, other)| Shot {
        kind,
        at,
        other,
    })
}

/// Few in ordinary runs.
fn cases() -> u32 {
    match std::env::var_os("SINEW_LONG") {
        Some(_) => 20_000,
        None => 48,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]
    #[test]
    fn no_sequence_of_edits_breaks_a_map(
        shots in prop::collection::vec(any_shot(), 0..40),
        start in 0..5usize,
    ) {
        run(&mut seed_map(start), &shots);
    }

    #[test]
    fn a_batch_that_fails_in_the_end_leaves_no_trace(
        shots in prop::collection::vec(any_shot(), 0..12),
        start in 0..5usize,
    ) {
        let mut map = seed_map(start);
        let before = map.digest();
        let refused = map.edit(|edit| {
            for &shot in &shots {
                // Whatever is refused on the way is skipped.
                let _ = edit.attempt(|edit| shoot(edit, shot));
            }
            Err::<(), _>(EditError::Full)
        });
        prop_assert!(refused.is_err());
        prop_assert_eq!(map.digest(), before);
        prop_assert_eq!(map.violations(), []);
    }

    #[test]
    fn several_edits_are_taken_back_at_once(
        shots in prop::collection::vec(any_shot(), 0..24),
        start in 0..5usize,
    ) {
        let mut map = seed_map(start);
        let (before, after) = shots.split_at(shots.len() / 2);
        for &shot in before {
            let _ = map.edit(|edit| shoot(edit, shot));
        }
        map.keep();
        let kept = map.digest();
        for _ in 0..2 {
            for &shot in after {
                let _ = map.edit(|edit| shoot(edit, shot));
            }
            map.revert();
            prop_assert_eq!(map.digest(), kept);
            prop_assert_eq!(map.violations(), []);
        }
    }

    #[test]
    fn a_batch_of_edits_that_may_be_refused_is_sound(
        shots in prop::collection::vec(any_shot(), 0..12),
        start in 0..5usize,
    ) {
        let mut map = seed_map(start);
        let mut ledger = Ledger::new(&map);
        let before = map.digest();
        let done = map.edit(|edit| {
            for &shot in &shots {
                let _ = edit.attempt(|edit| shoot(edit, shot));
            }
            Ok::<_, EditError>(())
        });
        match done {
            Ok(((), changes)) => {
                ledger.follow(&changes);
                prop_assert_eq!(ledger.alive, Ledger::new(&map).alive);
            }
            Err(_) => prop_assert_eq!(map.digest(), before),
        }
        prop_assert_eq!(map.violations(), []);
    }
}

#[test]
fn a_hundred_thousand_edits_on_each_of_several_seeds_break_nothing() {
    if std::env::var_os("SINEW_LONG").is_none() {
        println!("skipped: set SINEW_LONG=1 to run it");
        return;
    }
    for seed in 1..=8u64 {
        let mut state = seed;
        let mut random = |below: u64| {
            // SplitMix64.
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut bits = state;
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            usize::try_from((bits ^ (bits >> 31)) % below).expect("below a hundred thousand")
        };
        let shots: Vec<_> = (0..250_000)
            .map(|_| Shot {
                kind: u8::try_from(random(16)).expect("below 16"),
                at: random(100_000),
                other: random(100_000),
            })
            .collect();
        let mut map = seed_map(random(5));
        let [done, refused] = run(&mut map, &shots);
        println!("seed {seed}: {done} edits, {refused} refused");
    }
}
