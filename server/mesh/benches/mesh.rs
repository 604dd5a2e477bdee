//! What a topology change costs, and what loading costs: by number of cells.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use sinew_mesh::{Capsule, CellShape, inspect, lattice, shapes, surface, vertex_normals};

fn grids(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("mesh");
    group.sample_size(10);
    for (name, grid) in [
        ("105k tetrahedra", shapes::tetrahedra(26, 26, 26)),
        ("1M tetrahedra", shapes::tetrahedra(56, 56, 56)),
        ("500k hexahedra", shapes::hexahedra(80, 80, 80)),
    ] {
        group.throughput(Throughput::Elements(grid.cells.len() as u64));
        group.bench_function(BenchmarkId::new("check", name), |b| b.iter(|| grid.check()));
        group.bench_function(BenchmarkId::new("hash", name), |b| {
            b.iter(|| grid.cells.hash())
        });
        group.bench_function(BenchmarkId::new("surface", name), |b| {
            b.iter(|| surface(&grid.cells))
        });
        group.bench_function(BenchmarkId::new("inspect", name), |b| {
            b.iter(|| inspect(&grid))
        });
        let (skin, mut normals) = (surface(&grid.cells), Vec::new());
        group.bench_function(BenchmarkId::new("vertex_normals", name), |b| {
            b.iter(|| vertex_normals(&grid.positions, &skin, &mut normals));
        });
    }
}

fn lattices(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lattice");
    group.sample_size(10);
    // About a human body: a column and four limbs.
    let bone = |start: [f64; 3], end: [f64; 3], radius: f64| Capsule {
        start: Vector3::from(start),
        end: Vector3::from(end),
        radius,
    };
    let body = [
        bone([0.0, 0.0, 0.9], [0.0, 0.0, 1.5], 0.14),
        bone([0.0, 0.1, 0.9], [0.0, 0.15, 0.1], 0.08),
        bone([0.0, -0.1, 0.9], [0.0, -0.15, 0.1], 0.08),
        bone([0.0, 0.1, 1.45], [0.0, 0.6, 1.0], 0.05),
        bone([0.0, -0.1, 1.45], [0.0, -0.6, 1.0], 0.05),
    ];
    for (shape, spacing) in [
        (CellShape::Hexahedron, 0.02),
        (CellShape::Tetrahedron, 0.02),
        (CellShape::Tetrahedron, 0.01),
    ] {
        let cells = lattice(shape, spacing, &body).map_or(0, |grid| grid.cells.len());
        group.throughput(Throughput::Elements(cells as u64));
        group.bench_function(BenchmarkId::new(format!("{shape:?}"), cells), |b| {
            b.iter(|| lattice(shape, spacing, &body));
        });
    }
}

criterion_group!(benches, grids, lattices);
criterion_main!(benches);
