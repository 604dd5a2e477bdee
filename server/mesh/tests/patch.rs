//! Cells that change some of their slots: the same as cells made so from the start.

use proptest::prelude::*;
use sinew_mesh::{
    Cell, CellType, Cells, Grid, GridError, PatchError, inspect, repair, shapes, surface,
};

/// A cell of any kind, over the first 8 vertices.
#[derive(Clone, Debug)]
struct Any {
    kind: CellType,
    vertices: Vec<u32>,
    face_stream: Vec<u32>,
}

fn any_cell() -> impl Strategy<Value = Any> {
    let ring = Just((0..8).collect::<Vec<u32>>()).prop_shuffle();
    (0..5, ring).prop_map(|(kind, mut vertices)| {
        let kind = match kind {
            0 => CellType::Empty,
            1 => CellType::Triangle,
            2 => CellType::Tetrahedron,
            3 => CellType::Hexahedron,
            _ => CellType::Polyhedron,
        };
        vertices.truncate(kind.vertex_count().unwrap_or(4));
        let mut face_stream = Vec::new();
        if kind == CellType::Polyhedron {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| vertices[i]);
            face_stream = vec![4, 3, a, b, c, 3, a, d, b, 3, b, d, c, 3, c, d, a];
        }
        Any {
            kind,
            vertices,
            face_stream,
        }
    })
}

fn cells(any: &[Any]) -> Cells {
    let mut cells = Cells::default();
    for one in any {
        cells.push(Cell {
            kind: one.kind,
            vertices: &one.vertices,
            face_stream: &one.face_stream,
        });
    }
    cells
}

proptest! {
    #[test]
    fn patched_cells_are_those_made_so_from_the_start(
        before in prop::collection::vec(any_cell(), 0..12),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any_cell()), 0..12),
        appended in prop::collection::vec(any_cell(), 0..4),
    ) {
        let mut after = before.clone();
        let mut slots = Vec::new();
        if !before.is_empty() {
            for (at, form) in changes {
                let slot = at.index(before.len());
                after[slot] = form;
                slots.push(u32::try_from(slot).unwrap());
            }
        }
        for form in appended {
            slots.push(u32::try_from(after.len()).unwrap());
            after.push(form);
        }
        slots.sort_unstable();
        slots.dedup();
        let forms: Vec<_> = slots.iter().map(|&slot| after[slot as usize].clone()).collect();
        let (before, forms, after) = (cells(&before), cells(&forms), cells(&after));
        let patched = before.patched(&slots, &forms, 8).unwrap();
        prop_assert_eq!(patched.check(8), Ok(()));
        prop_assert!(patched.iter().eq(after.iter()));
        prop_assert_eq!(patched.face_offsets.is_empty(), patched.faces.is_empty());
        prop_assert_eq!(before.patched_hash(before.hash(), &slots, &forms), after.hash());
    }
}

#[test]
fn slots_that_make_no_sense_are_refused() {
    let grid = shapes::tetrahedra(1, 1, 1);
    let mut forms = Cells::default();
    for _ in 0..2 {
        forms.push(grid.cells.cell(0));
    }
    let patched = |slots: &[u32]| grid.cells.patched(slots, &forms, 8).unwrap_err();
    assert_eq!(patched(&[0]), PatchError::Length { slots: 1, cells: 2 });
    let (entry, slot) = (1, 3);
    let before = 3;
    assert_eq!(
        patched(&[3, 3]),
        PatchError::Order {
            entry,
            slot,
            before
        }
    );
    let (slot, next) = (8, 7);
    assert_eq!(patched(&[6, 8]), PatchError::Gap { entry, slot, next });
    let refused = grid.cells.patched(&[0, 6], &forms, 7).unwrap_err();
    assert!(
        matches!(
            refused,
            PatchError::Cells(GridError::IndexOutOfRange { value: 7, .. })
        ),
        "{refused}"
    );
}

#[test]
fn an_empty_slot_is_nowhere() {
    let mut grid = shapes::tetrahedra(2, 1, 1);
    let mut rest = Cells::default();
    for cell in grid.cells.iter().take(6) {
        rest.push(cell);
    }
    let mut forms = Cells::default();
    let slots: Vec<u32> = (6..12).collect();
    for _ in &slots {
        forms.push(Cell {
            kind: CellType::Empty,
            vertices: &[],
            face_stream: &[],
        });
    }
    grid.cells = grid.cells.patched(&slots, &forms, 12).unwrap();
    assert_eq!(grid.check(), Ok(()));
    assert_eq!(surface(&grid.cells), surface(&rest));
    let left = Grid {
        cells: rest,
        ..grid.clone()
    };
    let mut expected = inspect(&left);
    expected.counts.insert(0, (CellType::Empty, 6));
    assert_eq!(inspect(&grid), expected);
    let (repaired, repairs) = repair(grid);
    assert_eq!(repaired, repair(left).0);
    assert_eq!(repairs.cells, [0, 1, 2, 3, 4, 5]);
    assert_eq!(repairs.dropped.len(), 6);
}
