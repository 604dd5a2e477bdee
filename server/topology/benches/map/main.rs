//! What the map costs, for 10k, 100k and 1M tetrahedra: `cargo bench -p sinew-topology`.
//!
//! Where the environment variable `SINEW_CGAL` names a peer program (see [`peer`]), it runs on the same meshes, by turns
//! with the map, and the table shows both. All times are processor time of the whole process, on one thread: other
//! processes of the machine then disturb the figures less, and both sides alike.
#![allow(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]

mod kernel;
mod peer;
mod samples;

use samples::Samples;
use sinew_mesh::shapes;

/// Cubes along an axis; six tetrahedra each.
const SIDES: [usize; 3] = [12, 26, 56];
const ROUNDS: usize = 5;

fn main() {
    // cargo passes `--bench`; a plain test run measures nothing.
    if !std::env::args().any(|arg| arg == "--bench") {
        return;
    }
    let peer = peer::Peer::from_environment();
    let mut samples = Samples::default();
    for side in SIDES {
        let mesh = shapes::tetrahedra(side, side, side);
        let tetrahedra = mesh.cells.len();
        let input = peer.as_ref().map(|peer| peer.write(&mesh));
        for round in 0..ROUNDS {
            eprintln!("{tetrahedra} tetrahedra, round {} of {ROUNDS}", round + 1);
            kernel::measure(&mesh, &mut |row, figure| {
                samples.add(row, "map", tetrahedra, figure);
            });
            if let (Some(peer), Some(input)) = (&peer, &input) {
                peer.measure(input, &mut |row, variant, figure| {
                    samples.add(row, variant, tetrahedra, figure);
                });
            }
        }
    }
    print!("{samples}");
}
