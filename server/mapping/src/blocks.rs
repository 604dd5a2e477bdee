use nalgebra::Vector3;
use rayon::prelude::*;

/// Vertices per task: enough work to pay for a task, few enough for every thread to get some.
pub(crate) const BLOCK: usize = 2048;

/// Whether other threads shorten the work on so many vertices.
pub(crate) fn worth_sharing(vertices: usize) -> bool {
    vertices >= 8 * BLOCK && rayon::current_num_threads() > 1
}

/// Calls `pose(first, block)` for consecutive blocks of `out`, on the threads of the current pool if that is worth it.
///
/// No block sees another, so the result does not depend on who computes it.
pub(crate) fn for_each_block(
    out: &mut [Vector3<f64>],
    pose: impl Fn(usize, &mut [Vector3<f64>]) + Sync,
) {
    if worth_sharing(out.len()) {
        out.par_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(block, out)| pose(block * BLOCK, out));
    } else {
        pose(0, out);
    }
}
