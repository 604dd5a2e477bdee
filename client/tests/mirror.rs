//! Whatever becomes of the messages on their way, a mirror never shows a mesh that the session never had.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use nalgebra::Vector3;
use proptest::prelude::*;
use proptest::sample::Index;
use sinew_client::{Applied, MeshMirror, grid};
use sinew_mesh::{Cell, CellType, Cells, Grid};
use sinew_proto::v1::{
    Frame, Indices, Keyframe, Precision, Reals, TopologyPatch, UnstructuredGrid,
};

/// The session: every mesh that it ever had, by sequence from 1, and what it says of each.
struct Truth {
    meshes: Vec<Grid>,
    said: Vec<Said>,
    version: u64,
    epoch: u64,
    random: u64,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a few at a time")]
enum Said {
    Keyframe(Keyframe),
    Frame(Frame),
    Patch(TopologyPatch),
}

impl Truth {
    fn new(seed: u64) -> Self {
        let mut truth = Self {
            meshes: Vec::new(),
            said: Vec::new(),
            version: 0,
            epoch: 1,
            random: seed | 1,
        };
        let mut mesh = Grid::default();
        for _ in 0..1 + truth.below(4) {
            mesh.positions.push(Vector3::zeros());
        }
        for _ in 0..truth.below(5) {
            truth.push_cell(&mut mesh.cells, mesh.positions.len());
        }
        truth.move_on(mesh);
        truth
    }

    /// xorshift64*: the cases differ by proptest's seeds, so this need not be good.
    fn below(&mut self, limit: usize) -> usize {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        let high = self.random.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33;
        usize::try_from(high).unwrap() % limit
    }

    fn vertex(&mut self, vertices: usize) -> u32 {
        u32::try_from(self.below(vertices)).unwrap()
    }

    fn push_cell(&mut self, cells: &mut Cells, vertices: usize) {
        let kind = [
            CellType::Empty,
            CellType::Triangle,
            CellType::Tetrahedron,
            CellType::Polyhedron,
        ][self.below(4)];
        let mut corners: Vec<u32> = (0..u32::try_from(vertices).unwrap()).collect();
        let needed = kind.vertex_count().unwrap_or(4);
        if kind == CellType::Polyhedron && vertices < 4 {
            return self.push_cell(cells, vertices);
        }
        while corners.len() < needed || (needed == 0 && !corners.is_empty()) {
            if needed == 0 {
                corners.clear();
            } else {
                corners.push(self.vertex(vertices));
            }
        }
        while corners.len() > needed {
            let at = self.below(corners.len());
            corners.swap_remove(at);
        }
        let mut stream = Vec::new();
        if let (CellType::Polyhedron, [a, b, c, d]) = (kind, &corners[..]) {
            stream = vec![
                4, 3, *a, *b, *c, 3, *a, *d, *b, 3, *b, *d, *c, 3, *c, *d, *a,
            ];
        }
        cells.push(Cell {
            kind,
            vertices: &corners,
            face_stream: &stream,
        });
    }

    fn last(&self) -> &Grid {
        self.meshes.last().unwrap()
    }

    /// Gives the mesh other positions; it is the session's from now on.
    fn move_on(&mut self, mut mesh: Grid) -> Frame {
        let sequence = self.meshes.len() as f64 + 1.0;
        for (position, vertex) in mesh.positions.iter_mut().zip(0..) {
            *position = Vector3::new(sequence, f64::from(vertex), 0.5);
        }
        let frame = Frame {
            epoch: self.epoch,
            topology_version: self.version,
            sequence: self.meshes.len() as u64 + 1,
            layout_hash: mesh.cells.hash(),
            vertex_count: u32::try_from(mesh.positions.len()).unwrap(),
            vertices: Some(Reals::pack(
                &mesh
                    .positions
                    .iter()
                    .flat_map(|p| [p.x, p.y, p.z])
                    .collect::<Vec<_>>(),
                Precision::F64,
            )),
            ..Frame::default()
        };
        self.meshes.push(mesh);
        frame
    }

    fn step(&mut self) {
        let frame = self.move_on(self.last().clone());
        self.said.push(Said::Frame(frame));
    }

    /// A step that changes some cells, and appends some and some vertices.
    fn tear(&mut self) {
        let mut mesh = self.last().clone();
        let before = mesh.cells.len();
        let (mut parents, mut offsets) = (Vec::new(), vec![0]);
        for _ in 0..self.below(3) {
            for _ in 0..1 + self.below(2) {
                parents.push(self.vertex(mesh.positions.len()));
            }
            offsets.push(u32::try_from(parents.len()).unwrap());
            mesh.positions.push(Vector3::zeros());
        }
        let changed = (0..before)
            .filter(|_| self.below(3) == 0)
            .collect::<Vec<_>>();
        let appended = before..before + self.below(3);
        let slots: Vec<u32> = (changed.into_iter().chain(appended))
            .map(|slot| u32::try_from(slot).unwrap())
            .collect();
        let mut forms = Cells::default();
        for _ in &slots {
            self.push_cell(&mut forms, mesh.positions.len());
        }
        // By hand, not by what is under test.
        let mut cells = Cells::default();
        for slot in 0..before.max(slots.last().map_or(0, |&last| last as usize + 1)) {
            match slots.iter().position(|&changed| changed as usize == slot) {
                Some(form) => cells.push(forms.cell(form)),
                None => cells.push(mesh.cells.cell(slot)),
            }
        }
        mesh.cells = cells;
        let from_version = self.version;
        self.version += 1;
        let frame = self.move_on(mesh);
        self.said.push(Said::Patch(TopologyPatch {
            from_version,
            to_version: from_version + 1,
            vertex_parents: Some(Indices::pack(&parents)),
            vertex_parent_offsets: Some(Indices::pack(&offsets)),
            slots: Some(Indices::pack(&slots)),
            cells: Some(packed(&forms)),
            cell_parents: None,
            seams: None,
            frame: Some(frame),
        }));
    }

    /// A step that numbers everything anew.
    fn compact(&mut self) {
        let mut mesh = Grid {
            positions: self.last().positions.clone(),
            cells: Cells::default(),
        };
        for cell in self.last().cells.iter() {
            if cell.kind != CellType::Empty {
                mesh.cells.push(cell);
            }
        }
        self.epoch += 1;
        self.version += 1;
        self.move_on(mesh);
        self.said.push(Said::Keyframe(self.keyframe()));
    }

    /// The whole mesh as it is.
    fn keyframe(&self) -> Keyframe {
        let mesh = self.last();
        let mut columns = grid::to_proto(mesh);
        let frame = Frame {
            epoch: self.epoch,
            topology_version: self.version,
            sequence: self.meshes.len() as u64,
            layout_hash: mesh.cells.hash(),
            vertex_count: u32::try_from(mesh.positions.len()).unwrap(),
            vertices: columns.positions.take(),
            ..Frame::default()
        };
        Keyframe {
            grid: Some(columns),
            labels: Vec::new(),
            frame: Some(frame),
        }
    }
}

fn packed(cells: &Cells) -> UnstructuredGrid {
    let grid = Grid {
        positions: Vec::new(),
        cells: cells.clone(),
    };
    UnstructuredGrid {
        positions: None,
        ..grid::to_proto(&grid)
    }
}

/// What may happen between a session and a reader. An index stands for one of the messages under way.
#[derive(Clone, Debug)]
enum Happening {
    Step,
    Tear,
    Compact,
    /// The interval's keyframe, or the one asked for.
    Keyframe,
    /// A keyframe only where the mirror asks for one.
    Resync,
    Deliver,
    DeliverAny(Index),
    Drop(Index),
    Double(Index),
    /// A change of the past comes again, without its positions.
    Bare(Index),
    /// Another reader takes its place.
    Join,
}

fn any_happening() -> impl Strategy<Value = Happening> {
    let index = any::<Index>;
    prop_oneof![
        4 => Just(Happening::Step),
        4 => Just(Happening::Tear),
        1 => Just(Happening::Compact),
        1 => Just(Happening::Keyframe),
        2 => Just(Happening::Resync),
        8 => Just(Happening::Deliver),
        2 => index().prop_map(Happening::DeliverAny),
        1 => index().prop_map(Happening::Drop),
        1 => index().prop_map(Happening::Double),
        1 => index().prop_map(Happening::Bare),
        1 => Just(Happening::Join),
    ]
}

/// A reader and what is under way to it.
struct Reader {
    mirror: MeshMirror,
    under_way: Vec<Said>,
}

impl Reader {
    fn take(&mut self, index: &Index) -> Option<Said> {
        let count = self.under_way.len();
        (count > 0).then(|| self.under_way.remove(index.index(count)))
    }

    fn deliver(&mut self, said: &Said) -> Applied {
        match said {
            Said::Keyframe(keyframe) => self.mirror.keyframe(keyframe),
            Said::Frame(frame) => self.mirror.frame(frame),
            Said::Patch(patch) => self.mirror.patch(patch),
        }
        .expect("an honest session's messages make sense in any order")
    }

    fn happen(&mut self, truth: &mut Truth, happening: &Happening) {
        match happening {
            Happening::Step => truth.step(),
            Happening::Tear => truth.tear(),
            Happening::Compact => truth.compact(),
            Happening::Keyframe => self.under_way.push(Said::Keyframe(truth.keyframe())),
            Happening::Resync if self.mirror.needs_resync() => {
                self.under_way.push(Said::Keyframe(truth.keyframe()));
            }
            Happening::Resync => {}
            Happening::Deliver => {
                if let Some(said) = (!self.under_way.is_empty()).then(|| self.under_way.remove(0)) {
                    self.deliver(&said);
                }
            }
            Happening::DeliverAny(index) => {
                if let Some(said) = self.take(index) {
                    self.deliver(&said);
                }
            }
            Happening::Drop(index) => drop(self.take(index)),
            Happening::Double(index) => {
                if let Some(said) = self.take(index) {
                    self.under_way.extend([said.clone(), said]);
                }
            }
            Happening::Bare(index) => {
                let turns = truth.said.iter().filter_map(|said| match said {
                    Said::Patch(patch) => Some(patch),
                    Said::Keyframe(_) | Said::Frame(_) => None,
                });
                let turns: Vec<_> = turns.collect();
                if !turns.is_empty() {
                    let mut bare = (*index.get(&turns)).clone();
                    bare.frame.as_mut().unwrap().vertices = None;
                    self.under_way.push(Said::Patch(bare));
                }
            }
            Happening::Join => {
                self.mirror = MeshMirror::default();
                self.under_way = vec![Said::Keyframe(truth.keyframe())];
            }
        }
    }

    /// What is shown was so.
    fn check(&self, truth: &Truth) {
        let Some(sequence) = self.mirror.shown() else {
            assert_eq!(self.mirror.grid().unwrap(), None);
            return;
        };
        let shown = self.mirror.grid().unwrap().unwrap();
        let was = &truth.meshes[usize::try_from(sequence).unwrap() - 1];
        assert_eq!(shown.positions, was.positions);
        assert!(shown.cells.iter().eq(was.cells.iter()));
    }
}

fn cases() -> u32 {
    let long = std::env::var_os("SINEW_LONG").is_some();
    if long { 1_000_000 } else { 1_000 }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: cases(),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn no_fate_of_messages_makes_a_mirror_show_what_never_was(
        seed in any::<u64>(),
        happenings in prop::collection::vec(any_happening(), 0..40),
    ) {
        let mut truth = Truth::new(seed);
        let mut reader = Reader {
            mirror: MeshMirror::default(),
            under_way: vec![Said::Keyframe(truth.keyframe())],
        };
        for happening in &happenings {
            let said = truth.said.len();
            reader.happen(&mut truth, happening);
            reader.under_way.extend_from_slice(&truth.said[said..]);
            reader.check(&truth);
        }
        // Whatever happened: one keyframe, and all is well from then on, bit for bit.
        let keyframe = truth.keyframe();
        reader.deliver(&Said::Keyframe(keyframe));
        let said = truth.said.len();
        for _ in 0..2 {
            truth.tear();
            truth.step();
        }
        for said in &truth.said[said..] {
            prop_assert!(matches!(reader.deliver(said), Applied::Mesh | Applied::Positions));
            reader.check(&truth);
        }
        prop_assert_eq!(reader.mirror.shown(), Some(truth.meshes.len() as u64));
        prop_assert!(!reader.mirror.needs_resync() && reader.mirror.is_proven());
    }

    #[test]
    fn a_patch_that_lies_changes_nothing_and_asks_for_a_keyframe(
        seed in any::<u64>(), lie in 0..7, value in any::<u32>()
    ) {
        let mut truth = Truth::new(seed);
        let mut mirror = MeshMirror::default();
        mirror.keyframe(&truth.keyframe()).unwrap();
        truth.tear();
        let Some(Said::Patch(mut patch)) = truth.said.pop() else { panic!("a tear") };
        let honest = patch.clone();
        let frame = patch.frame.as_mut().unwrap();
        match lie {
            0 => frame.layout_hash ^= u64::from(value) + 1,
            1 => frame.vertex_count = value,
            2 => patch.slots = Some(Indices { values: vec![value], ..Indices::default() }),
            3 => patch.cells.as_mut().unwrap().cell_types = vec![12].into(),
            4 => patch.vertex_parents = Some(Indices::pack(&[u32::MAX])),
            5 => patch.vertex_parent_offsets = Some(Indices::pack(&[1, value])),
            _ => frame.vertices = Some(Reals::default()),
        }
        prop_assume!(patch != honest && !(lie == 6 && honest.frame.as_ref().unwrap().vertex_count == 0));
        let before = mirror.cells().cloned();
        // Some lies are the same in other words.
        if mirror.patch(&patch).is_err() {
            prop_assert_eq!(mirror.cells().cloned(), before);
            prop_assert!(mirror.needs_resync() && mirror.shown().is_none());
            prop_assert!(mirror.is_proven());
        } else {
            prop_assert!(mirror.cells().unwrap().iter().eq(truth.last().cells.iter()));
        }
    }
}
