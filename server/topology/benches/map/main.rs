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
//! | build | 29.9 ns per dart | 3.6× | 7.4× | 1.05 |
//! | bytes | 26.8 per dart | 2.1× | 3.3× | 0.99 |
//! | orbit_vertex | 6.8 ns per dart | 7.2× | 9.5× | 1.01 |
//! | orbit_edge | 6.9 ns per dart | 4.8× | 6.6× | 1.03 |
//! | orbit_face | 6.8 ns per dart | 3.6× | 4.1× | 1.00 |
//! | orbit_volume | 6.5 ns per dart | 3.8× | 3.8× | 1.00 |
//! | adjacency_vertex_snapshot | 12.4 ns per entry | 22.2× | 27.9× | 1.02 |
//! | adjacency_volume_snapshot | 7.4 ns per entry |  | 23.8× | 1.07 |
//! | adjacency_vertex_random | 7551 ns per query | 1.7× | 2.0× | 1.43 |
//! | adjacency_volume_random | 1679 ns per query | 1.3× | 1.6× | 1.47 |
//! | relink3 | 207.8 ns per face | 0.5× | 0.5× | 1.20 |
//! | unsew3 | 524.6 ns per face | 17.3× | 24.8× | 1.16 |
//! | sew3 | 272.3 ns per face | 0.7× | 1.6× | 1.04 |
//! | resew3 | 398.0 ns per face | 11.6× | 16.9× | 1.09 |
//! | unsew3_rolled_back | 578.2 ns per face |  |  | 1.13 |
//! | tear_unsew3 | 1788 ns per face | 14.8× | 16.9× | 1.07 |
//! | tear_sew3 | 1992 ns per face | 1.0× | 1.2× | 1.27 |
//! | cut | 9382 ns per tetrahedron | 0.6× | 0.9× | 0.94 |
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
