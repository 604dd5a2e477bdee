//! Every value is checked, and the error names its column, its entry, the value and the remedy.

use nalgebra::Vector3;
use sinew_particles::{Network, NetworkSpec};

fn sound() -> NetworkSpec {
    NetworkSpec {
        positions: vec![Vector3::zeros(), Vector3::x(), Vector3::y()],
        velocities: vec![Vector3::zeros(); 3],
        masses: vec![1.0; 3],
        fixed: vec![0],
        springs: vec![[0, 1], [1, 2]],
        stiffness: vec![1.0; 2],
        damping: vec![0.0; 2],
        rest_lengths: Some(vec![1.0; 2]),
        gravity: Vector3::zeros(),
    }
}

#[test]
fn a_sound_specification_is_accepted_and_so_is_an_empty_one() {
    Network::new(sound()).unwrap();
    let mut empty = Network::new(NetworkSpec::default()).unwrap();
    empty.step(1.0).unwrap();
}

#[test]
fn each_fault_is_refused_by_name() {
    type Spoil = fn(&mut NetworkSpec);
    let faults: [(Spoil, &str); 14] = [
        (
            |s| s.velocities.truncate(2),
            "`velocities` has 2 entries where there are 3 particles: give one for each",
        ),
        (|s| s.masses.push(1.0), "`masses` has 4 entries"),
        (
            |s| s.stiffness.clear(),
            "`stiffness` has 0 entries where there are 2 springs",
        ),
        (|s| s.damping.clear(), "`damping` has 0 entries"),
        (
            |s| s.rest_lengths = Some(vec![]),
            "`rest_lengths` has 0 entries",
        ),
        (
            |s| s.positions[2].y = f64::NAN,
            "`positions[2]` is NaN: it must be finite",
        ),
        (
            |s| s.velocities[1].z = f64::INFINITY,
            "`velocities[1]` is inf",
        ),
        (
            |s| s.masses[1] = 0.0,
            "`masses[1]` is 0: it must be finite and above 0",
        ),
        (
            |s| s.stiffness[1] = -2.5,
            "`stiffness[1]` is -2.5: it must be finite and not below 0",
        ),
        (|s| s.damping[0] = f64::NAN, "`damping[0]` is NaN"),
        (
            |s| s.rest_lengths = Some(vec![1.0, -1.0]),
            "`rest_lengths[1]` is -1",
        ),
        (
            |s| s.gravity.x = f64::NAN,
            "`gravity` has the component NaN",
        ),
        (
            |s| s.fixed.push(3),
            "`fixed[1]` names particle 3, but there are 3: count from 0",
        ),
        (|s| s.springs[1] = [2, 9], "`springs[1]` names particle 9"),
    ];
    for (spoil, message) in faults {
        let mut spec = sound();
        spoil(&mut spec);
        let error = Network::new(spec).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn a_spring_from_a_particle_to_itself_is_refused() {
    let mut spec = sound();
    spec.springs[0] = [1, 1];
    let error = Network::new(spec).unwrap_err().to_string();
    assert!(
        error.starts_with("`springs[0]` joins particle 1 to itself"),
        "{error}"
    );
}

#[test]
fn a_fixed_particle_keeps_its_place_whatever_velocity_it_was_given() {
    let mut spec = sound();
    spec.velocities[0] = Vector3::repeat(5.0);
    let mut network = Network::new(spec).unwrap();
    network.step(0.1).unwrap();
    network.step(0.1).unwrap();
    assert_eq!(network.positions()[0], Vector3::zeros());
    assert_eq!(network.velocities()[0], Vector3::zeros());
}
