//! What each kind of link does.

use nalgebra::Vector3;
use sinew_particles::{Driven, Elastic, LinkLaw, Links, SystemSpec, Track};

use crate::{build, elastic, particles, run, springs};

fn x(x: f64) -> Vector3<f64> {
    Vector3::new(x, 0.0, 0.0)
}

/// A link of unit length at the start, from the origin to a particle that is driven along x through these lengths, one
/// a second.
fn stretched(law: LinkLaw, lengths: &[f64]) -> SystemSpec {
    SystemSpec {
        fixed: vec![0],
        driven: vec![Driven {
            particle: 1,
            path: Track {
                times: (0..lengths.len()).map(|i| i as f64).collect(),
                values: lengths.iter().map(|&length| x(length)).collect(),
            },
        }],
        links: vec![Links {
            ends: vec![[0, 1]],
            law,
        }],
        ..particles(vec![Vector3::zeros(), x(lengths[0])])
    }
}

/// The link's force on its driven end, N, at each of the lengths and four times between each two of them.
fn forces(law: LinkLaw, lengths: &[f64]) -> Vec<f64> {
    let mut system = build(stretched(law, lengths));
    let mut forces = vec![system.link_forces(0)[0].x];
    for _ in 1..5 * lengths.len() - 4 {
        run(&mut system, 1, 0.2);
        forces.push(system.link_forces(0)[0].x);
    }
    forces
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-12
}

#[test]
fn each_link_pulls_by_its_own_constants_be_they_few_or_many() {
    // The first 2,000 links have three kinds of constants, the next as many as there are links.
    let constants = |link: usize, many: bool| {
        let kind = if many { link } else { link % 3 } as f64;
        [1.0 + kind, 0.1 + 0.01 * kind, 0.5 + 0.001 * kind]
    };
    for many in [false, true] {
        let links = 2_000;
        let column = |k: usize| (0..links).map(|link| constants(link, many)[k]).collect();
        let system = build(SystemSpec {
            velocities: (0..=links).map(|i| x(-0.1 * i as f64)).collect(),
            links: vec![Links {
                ends: (0..2_000).map(|i| [i, i + 1]).collect(),
                law: LinkLaw::Spring(Elastic {
                    stiffness: column(0),
                    damping: column(1),
                    rest_lengths: Some(column(2)),
                }),
            }],
            ..particles((0..=links).map(|i| x(0.6 * i as f64)).collect())
        });
        let force = |link: usize| {
            let [stiffness, damping, rest] = constants(link, many);
            stiffness * (rest - 0.6) + 0.1 * damping
        };
        for (link, found) in system.link_forces(0).iter().enumerate() {
            assert!((found.x - force(link)).abs() < 1e-9, "{link}");
        }
        let [forces, _] = system.loads();
        for (i, found) in forces.iter().enumerate().skip(1).take(links - 1) {
            assert!((found.x - force(i - 1) + force(i)).abs() < 1e-9, "{i}");
        }
    }
}

#[test]
fn a_contact_pushes_and_never_pulls() {
    let law = || LinkLaw::Contact(elastic(1, 10.0, 0.0, 1.0));
    let found = forces(law(), &[1.5, 0.5, 1.5]);
    for (i, force) in found.iter().enumerate() {
        let length = 0.5 + (i as f64 * 0.2 - 1.0).abs();
        assert!(
            close(*force, (10.0 * (1.0 - length)).max(0.0)),
            "{i}: {force}"
        );
    }
    // Leaving so fast that the damper would pull.
    let damped = LinkLaw::Contact(elastic(1, 10.0, 100.0, 1.0));
    assert_eq!(forces(damped, &[0.5, 0.9])[2], 0.0);
}

#[test]
fn a_broken_link_stays_broken() {
    let law = LinkLaw::Breaking {
        elastic: elastic(1, 10.0, 0.0, 1.0),
        elongations: vec![0.5],
    };
    let mut system = build(stretched(law, &[1.0, 1.4, 1.6, 1.0]));
    run(&mut system, 1, 1.0);
    assert!(close(system.link_forces(0)[0].x, -4.0));
    assert_eq!(system.broken_links(0), [false]);
    run(&mut system, 1, 1.0);
    assert_eq!(system.broken_links(0), [true]);
    run(&mut system, 1, 1.0);
    assert_eq!(system.link_forces(0)[0].x, 0.0);
    assert_eq!(system.energy(), 0.0);
}

#[test]
fn a_plastic_link_keeps_the_length_it_was_forced_to() {
    let law = LinkLaw::Plastic {
        elastic: elastic(1, 10.0, 0.0, 1.0),
        yields: vec![0.1],
    };
    // Stretched to 1.5 it flows to a rest length of 1.4; pressed to 1.0 it flows to 1.1.
    let found = forces(law, &[1.0, 1.5, 1.4, 1.0, 1.1]);
    assert!(
        close(found[5], -1.0),
        "saturated while stretched: {found:?}"
    );
    assert!(
        close(found[10], 0.0),
        "no force at its new length: {found:?}"
    );
    assert!(close(found[15], 1.0), "saturated while pressed: {found:?}");
    assert!(
        close(found[20], 0.0),
        "no force at its last length: {found:?}"
    );
}

#[test]
fn a_table_is_piecewise_linear_and_goes_on_beyond_its_ends() {
    let law = LinkLaw::Table {
        lengths: vec![1.0, 2.0, 4.0],
        forces: vec![5.0, 1.0, -3.0],
    };
    let found = forces(law, &[0.5, 5.0]);
    let expected = |length: f64| {
        if length < 2.0 {
            5.0 - 4.0 * (length - 1.0)
        } else {
            1.0 - 2.0 * (length - 2.0)
        }
    };
    for (i, force) in found.iter().enumerate() {
        let length = 0.5 + 0.9 * i as f64;
        assert!(close(*force, expected(length)), "{length}: {force}");
    }
}

#[test]
fn friction_sticks_up_to_its_limit_then_slips_at_it_and_sticks_again() {
    let law = LinkLaw::Friction {
        stiffness: vec![10.0],
        limits: vec![2.0],
    };
    let found = forces(law, &[1.0, 1.1, 2.0, 1.9]);
    assert!(close(found[5], -1.0), "sticks: {found:?}");
    assert!(close(found[10], -2.0), "slips: {found:?}");
    assert!(
        close(found[15], -1.0),
        "sticks where it slipped to: {found:?}"
    );
}

#[test]
fn a_block_with_dry_friction_stops_for_good() {
    let mut system = build(SystemSpec {
        fixed: vec![0],
        velocities: vec![Vector3::zeros(), x(1.0)],
        links: vec![Links {
            ends: vec![[0, 1]],
            law: LinkLaw::Friction {
                stiffness: vec![1e4],
                limits: vec![2.0],
            },
        }],
        damping: 1.0,
        ..particles(vec![Vector3::zeros(), x(1.0)])
    });
    run(&mut system, 40_000, 1e-3);
    let braked = system.positions()[1].x;
    // Coulomb's friction and the drag: v' = −2 − v from 1, which ends at ln 1.5 after 1 − 2 ln 1.5.
    assert!((braked - 2.0 + 2.0 * 1.5_f64.ln()).abs() < 2e-3, "{braked}");
    assert!(system.velocities()[1].norm() < 1e-6);
    run(&mut system, 1_000, 1e-3);
    assert!((system.positions()[1].x - braked).abs() < 1e-9);
}

#[test]
fn every_force_without_memory_or_damping_is_the_slope_of_its_energy() {
    let laws = [
        LinkLaw::Spring(elastic(1, 10.0, 0.0, 1.0)),
        LinkLaw::Contact(elastic(1, 10.0, 0.0, 1.0)),
        LinkLaw::Breaking {
            elastic: elastic(1, 10.0, 0.0, 1.0),
            elongations: vec![5.0],
        },
        LinkLaw::Plastic {
            elastic: elastic(1, 10.0, 0.0, 1.0),
            yields: vec![5.0],
        },
        LinkLaw::Table {
            lengths: vec![0.5, 1.0, 2.0],
            forces: vec![5.0, 1.0, -3.0],
        },
        LinkLaw::Friction {
            stiffness: vec![10.0],
            limits: vec![100.0],
        },
    ];
    for law in laws {
        let at = |length: f64| {
            // The friction's anchor is where the first length puts it.
            let mut system = build(stretched(law.clone(), &[1.0, length]));
            run(&mut system, 1, 1.0);
            (system.energy(), system.link_forces(0)[0].x)
        };
        for length in [0.3, 0.7, 1.3, 2.2] {
            let h = 1e-5;
            let slope = (at(length + h).0 - at(length - h).0) / (2.0 * h);
            let force = at(length).1;
            assert!(
                (force + slope).abs() < 1e-6,
                "{law:?} at {length}: {force} {slope}"
            );
        }
    }
}

#[test]
fn a_driven_particle_moves_as_its_path_says_and_drags_the_others() {
    let path = Track {
        times: vec![0.0, 1.0, 2.0],
        values: vec![x(1.0), x(3.0), x(3.0)],
    };
    for integrator in crate::INTEGRATORS {
        let mut system = build(SystemSpec {
            driven: vec![Driven {
                particle: 0,
                path: path.clone(),
            }],
            links: vec![springs(vec![[0, 1]], 1e3, 20.0, 1.0)],
            integrator,
            ..particles(vec![Vector3::zeros(), x(2.0)])
        });
        assert_eq!(system.positions()[0], x(1.0));
        run(&mut system, 50, 0.01);
        assert!((system.positions()[0] - x(2.0)).norm() < 1e-12);
        assert!((system.velocities()[0] - x(2.0)).norm() < 1e-12);
        run(&mut system, 450, 0.01);
        assert_eq!(system.positions()[0], x(3.0));
        assert!(
            (system.positions()[1] - x(4.0)).norm() < 1e-6,
            "{integrator:?}"
        );
    }
}
