//! What the map costs, for 10k, 100k and 1M tetrahedra: `cargo bench -p sinew-topology`.
//!
//! The report's section `topology` measures the same, by [`kernel`] and [`peer`].
//!
//! Where the environment variable `SINEW_CGAL` names a peer program (see [`peer`]), it runs on the same meshes, by turns
//! with the map, and the table shows both. All times are processor time of the whole process, on one thread: other
//! processes of the machine then disturb the figures less, and both sides alike.
//!
//! Medians of five rounds at 1,053,696 tetrahedra, on one thread of a busy machine, and the peer's median over ours in
//! that run. CGAL's linear cell complex stores numbers on the points alone (lean), or on all cells as the map does (full).
//! p is that of time ~ cells^p, over all three sizes.
//!
//! | row | map | lean | full | p |
//! | --- | --- | --- | --- | --- |
//! | build | 28.9 ns per dart | 3.4× | 7.5× | 1.14 |
//! | bytes | 26.8 per dart | 2.1× | 3.3× | 1.00 |
//! | orbit_vertex | 6.2 ns per dart | 7.5× | 10.0× | 1.01 |
//! | orbit_edge | 6.7 ns per dart | 4.6× | 6.5× | 1.04 |
//! | orbit_face | 6.4 ns per dart | 3.6× | 4.1× | 1.00 |
//! | orbit_volume | 5.9 ns per dart | 3.8× | 4.0× | 0.99 |
//! | adjacency_vertex_snapshot | 12.1 ns per entry | 21.5× | 27.1× | 1.08 |
//! | adjacency_volume_snapshot | 6.8 ns per entry |  | 23.9× | 1.09 |
//! | adjacency_vertex_random | 7699 ns per query | 1.6× | 1.9× | 1.50 |
//! | adjacency_volume_random | 1724 ns per query | 1.2× | 1.6× | 1.53 |
//! | relink3 | 90.3 ns per face | 1.1× | 1.2× | 1.27 |
//! | unsew3 | 240.7 ns per face | 36.3× | 51.7× | 1.13 |
//! | sew3 | 240.0 ns per face | 0.7× | 1.8× | 1.13 |
//! | resew3 | 240.4 ns per face | 18.5× | 26.8× | 1.13 |
//! | unsew3_rolled_back | 322.4 ns per face |  |  | 1.20 |
//! | tear_unsew3 | 1652 ns per face | 15.3× | 17.3× | 1.22 |
//! | tear_sew3 | 2153 ns per face | 0.7× | 1.1× | 1.37 |
//! | cut | 6842 ns per tetrahedron | 0.8× | 1.2× | 0.93 |
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
    let program = std::env::var_os("SINEW_CGAL");
    let peer = program.map(|program| peer::Peer::new(program.into()));
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
