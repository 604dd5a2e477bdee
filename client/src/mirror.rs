//! A session's mesh, held by a client.

use sinew_mesh::{Cells, Grid};
use sinew_proto::v1::{Frame, Indices, Keyframe, Reals, TopologyPatch, UnstructuredGrid};

use crate::{ClientError, grid};

/// A copy of a session's mesh that keyframes, patches and frames keep up to date, in whatever order and however often
/// they come. It shows positions only on the mesh that they belong to; where it has none to show, it says so, and
/// whether only a keyframe can help.
///
/// ```
/// use sinew_client::{Applied, MeshMirror, grid};
/// use sinew_mesh::shapes;
/// use sinew_proto::v1;
///
/// let sent = shapes::tetrahedra(1, 1, 1);
/// let mut packed = grid::to_proto(&sent);
/// let frame = v1::Frame {
///     sequence: 1,
///     layout_hash: sent.cells.hash(),
///     vertex_count: 8,
///     vertices: packed.positions.take(),
///     ..v1::Frame::default()
/// };
/// let keyframe = v1::Keyframe { grid: Some(packed), frame: Some(frame.clone()), labels: vec![] };
///
/// let mut mirror = MeshMirror::default();
/// assert_eq!(mirror.keyframe(&keyframe)?, Applied::Mesh);
/// assert_eq!(mirror.grid()?, Some(sent));
///
/// // Positions of another mesh are not shown, and neither are the old ones any more.
/// let other = v1::Frame { sequence: 2, topology_version: 1, ..frame };
/// assert_eq!(mirror.frame(&other)?, Applied::Unfit);
/// assert!(mirror.needs_resync() && mirror.grid()?.is_none());
/// # Ok::<(), sinew_client::ClientError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct MeshMirror {
    held: Option<Held>,
    /// Sequence of the newest item that did not fit, until the mesh is as new.
    unfit: Option<u64>,
}

#[derive(Clone, Debug)]
struct Held {
    fit: Fit,
    sequence: u64,
    cells: Cells,
    /// Those of `sequence`; none where they are still to come.
    positions: Option<Reals>,
}

/// What an item did to a mirror.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applied {
    /// The mesh is another.
    Mesh,
    /// The positions are new.
    Positions,
    /// Nothing: the mirror is as new already.
    Stale,
    /// Nothing: it belongs to a mesh that the mirror does not hold. There is nothing to show until a keyframe comes.
    Unfit,
}

/// Which mesh positions belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fit {
    epoch: u64,
    topology_version: u64,
    layout_hash: u64,
    vertex_count: u32,
}

impl Fit {
    fn of(frame: &Frame) -> Self {
        Self {
            epoch: frame.epoch,
            topology_version: frame.topology_version,
            layout_hash: frame.layout_hash,
            vertex_count: frame.vertex_count,
        }
    }
}

impl MeshMirror {
    /// Takes the whole mesh.
    ///
    /// # Errors
    /// [`ClientError::Protocol`] where the cells make no sense or do not have the hash that they claim, or where there
    /// are more or fewer positions than vertices. Nothing is changed then.
    pub fn keyframe(&mut self, keyframe: &Keyframe) -> Result<Applied, ClientError> {
        let Some(frame) = &keyframe.frame else {
            return Err(protocol("a keyframe without a frame"));
        };
        if (self.held.as_ref()).is_some_and(|held| frame.sequence < held.sequence) {
            return Ok(Applied::Stale);
        }
        let positions = positions_of(frame)?;
        let sequence = frame.sequence;
        let none = UnstructuredGrid::default();
        let cells = grid::cells(keyframe.grid.as_ref().unwrap_or(&none))?;
        if let Err(error) = cells.check(frame.vertex_count as usize) {
            let problem = format!("the cells of keyframe {sequence} are none: {error}");
            return Err(protocol(&problem));
        }
        check_hash("keyframe", frame, cells.hash())?;
        self.held = Some(Held {
            fit: Fit::of(frame),
            sequence,
            cells,
            positions: Some(positions),
        });
        self.reached(sequence);
        Ok(Applied::Mesh)
    }

    /// Takes a change of the mesh, and the positions that come with it. A patch without positions leaves nothing to show
    /// until the next item.
    ///
    /// # Errors
    /// [`ClientError::Protocol`] where the patch makes no sense or leads to other cells than it claims. The mirror then
    /// needs a resync.
    pub fn patch(&mut self, patch: &TopologyPatch) -> Result<Applied, ClientError> {
        let Some(frame) = &patch.frame else {
            return Err(protocol("a patch without a frame"));
        };
        if patch.from_version.checked_add(1) != Some(patch.to_version)
            || frame.topology_version != patch.to_version
        {
            return Err(protocol("a patch that leads beyond the next version"));
        }
        let Some(held) = &self.held else {
            return Ok(self.unfit(frame));
        };
        if frame.sequence <= held.sequence {
            return Ok(Applied::Stale);
        }
        if frame.epoch != held.fit.epoch || patch.from_version != held.fit.topology_version {
            return Ok(self.unfit(frame));
        }
        let patched = patched(held, patch, frame);
        if patched.is_err() {
            self.unfit(frame);
        }
        self.held = Some(patched?);
        self.reached(frame.sequence);
        Ok(Applied::Mesh)
    }

    /// Takes positions.
    ///
    /// # Errors
    /// [`ClientError::Protocol`] where there are more or fewer positions than vertices. Nothing is changed then.
    pub fn frame(&mut self, frame: &Frame) -> Result<Applied, ClientError> {
        let positions = positions_of(frame)?;
        let Some(held) = &mut self.held else {
            return Ok(self.unfit(frame));
        };
        let shown = held.positions.is_some();
        if frame.sequence < held.sequence || (frame.sequence == held.sequence && shown) {
            return Ok(Applied::Stale);
        }
        if Fit::of(frame) != held.fit {
            return Ok(self.unfit(frame));
        }
        held.sequence = frame.sequence;
        held.positions = Some(positions);
        self.reached(frame.sequence);
        Ok(Applied::Positions)
    }

    fn reached(&mut self, sequence: u64) {
        self.unfit = self.unfit.filter(|&unfit| unfit > sequence);
    }

    fn unfit(&mut self, frame: &Frame) -> Applied {
        if let Some(held) = &mut self.held {
            held.positions = None;
        }
        self.unfit = self.unfit.max(Some(frame.sequence));
        Applied::Unfit
    }

    /// Whether something came that does not fit, and the mesh is not as new yet: ask for a keyframe.
    pub fn needs_resync(&self) -> bool {
        self.unfit.is_some()
    }

    /// The cells held, whether there are positions for them or not; none before the first keyframe.
    pub fn cells(&self) -> Option<&Cells> {
        self.held.as_ref().map(|held| &held.cells)
    }

    /// The hash that the server gives for the cells held.
    pub fn layout_hash(&self) -> Option<u64> {
        self.held.as_ref().map(|held| held.fit.layout_hash)
    }

    /// Whether the cells held are the server's, bit for bit: takes their hash anew. Time is linear in the cells.
    pub fn is_proven(&self) -> bool {
        let proven = |held: &Held| held.cells.hash() == held.fit.layout_hash;
        self.held.as_ref().is_some_and(proven)
    }

    /// Sequence of the frame whose positions are shown; none where there is nothing to show.
    pub fn shown(&self) -> Option<u64> {
        let held = self.held.as_ref()?;
        held.positions.as_ref().map(|_| held.sequence)
    }

    /// The topology version of the cells held.
    pub fn topology_version(&self) -> Option<u64> {
        self.held.as_ref().map(|held| held.fit.topology_version)
    }

    /// The mesh to draw; none where there is nothing to show.
    ///
    /// # Errors
    /// [`ClientError::Protocol`] where the positions cannot be read.
    pub fn grid(&self) -> Result<Option<Grid>, ClientError> {
        let Some((held, positions)) =
            (self.held.as_ref()).and_then(|held| Some((held, held.positions.as_ref()?)))
        else {
            return Ok(None);
        };
        Ok(Some(Grid {
            positions: grid::positions(Some(positions))?,
            cells: held.cells.clone(),
        }))
    }
}

/// What a patch makes of the mesh that it belongs to.
fn patched(held: &Held, patch: &TopologyPatch, frame: &Frame) -> Result<Held, ClientError> {
    let appended = check_parents(patch, frame.vertex_count)?;
    if held.fit.vertex_count.checked_add(appended) != Some(frame.vertex_count) {
        return Err(protocol(&format!(
            "a patch that appends {appended} vertices to {} and claims to have {}",
            held.fit.vertex_count, frame.vertex_count
        )));
    }
    let slots = column(&patch.slots)?;
    let forms = match &patch.cells {
        Some(cells) => grid::cells(cells)?,
        None => Cells::default(),
    };
    let cells = (held.cells)
        .patched(&slots, &forms, frame.vertex_count as usize)
        .map_err(|error| protocol(&format!("a patch that cannot be applied: {error}")))?;
    let hash = (held.cells).patched_hash(held.fit.layout_hash, &slots, &forms);
    check_hash("patch", frame, hash)?;
    let bare = frame.vertices.is_none() && frame.vertex_count > 0;
    Ok(Held {
        fit: Fit::of(frame),
        sequence: frame.sequence,
        cells,
        positions: if bare {
            None
        } else {
            Some(positions_of(frame)?)
        },
    })
}

/// That each appended vertex comes from vertices that there are; how many are appended.
fn check_parents(patch: &TopologyPatch, vertices: u32) -> Result<u32, ClientError> {
    let offsets = column(&patch.vertex_parent_offsets)?;
    let parents = column(&patch.vertex_parents)?;
    let ends = [offsets.first(), offsets.last()].map(|end| end.map_or(0, |&end| end as usize));
    let sound = ends == [0, parents.len()]
        && offsets.is_sorted()
        && parents.iter().all(|&parent| parent < vertices);
    let appended = u32::try_from(offsets.len().saturating_sub(1)).ok();
    (appended.filter(|_| sound))
        .ok_or_else(|| protocol("a patch whose vertices come from none that there are"))
}

fn column(indices: &Option<Indices>) -> Result<Vec<u32>, ClientError> {
    let column = indices.as_ref().map_or(Ok(Vec::new()), Indices::unpack);
    column.map_err(|error| protocol(&format!("a column of a patch {error}")))
}

/// A frame's positions, one per vertex.
fn positions_of(frame: &Frame) -> Result<Reals, ClientError> {
    let positions = frame.vertices.clone().unwrap_or_default();
    let numbers = positions.f32.len() / 4 + positions.f64.len() / 8 + positions.values.len();
    if numbers == 3 * frame.vertex_count as usize {
        Ok(positions)
    } else {
        Err(protocol(&format!(
            "frame {} has {numbers} coordinates for {} vertices",
            frame.sequence, frame.vertex_count
        )))
    }
}

fn check_hash(what: &str, frame: &Frame, hash: u64) -> Result<(), ClientError> {
    if hash == frame.layout_hash {
        Ok(())
    } else {
        Err(protocol(&format!(
            "the cells of {what} {} have the hash {hash:016x}, not {:016x} as it says",
            frame.sequence, frame.layout_hash
        )))
    }
}

fn protocol(what: &str) -> ClientError {
    ClientError::Protocol(what.to_owned())
}
