//! What a mesh holds, and what is wrong with it.

use std::{
    fs::File,
    io::{BufWriter, Write as _},
    path::Path,
};

use serde_json::{Value, json};
use sinew_client::vtk;
use sinew_formats::mesh::{self, Loaded};
use sinew_mesh::{Grid, Inspection, Repairs};

use super::{Arguments, some};
use crate::out::{put, say};
use crate::{
    Failure,
    table::{Table, count},
};

pub(super) fn inspect(arguments: &Arguments) -> Result<(), Failure> {
    let loaded = mesh::read(&arguments.file)?;
    let inspection = sinew_mesh::inspect(&loaded.grid);
    if arguments.json {
        say!("{:#}", to_json(&loaded, &inspection));
    } else {
        say!("{}: {}", arguments.file.display(), loaded.format);
        put!("{}", describe(&loaded, &inspection));
    }
    if let Some(out) = &arguments.repair {
        let (grid, repairs) = sinew_mesh::repair(loaded.grid);
        write(&grid, out)?;
        // Beside the JSON, stdout has no room for a sentence.
        eprintln!("{}", told(&repairs, &grid, out));
    }
    Ok(())
}

fn write(grid: &Grid, out: &Path) -> Result<(), Failure> {
    let format = vtk::Format::of(out).ok_or_else(|| {
        format!(
            "{}: a repaired mesh is written as .vtk or .vtu",
            out.display()
        )
    })?;
    let save = || {
        let mut file = BufWriter::new(File::create(out)?);
        vtk::write(grid, format, &mut file)?;
        file.flush()
    };
    Ok(save().map_err(|error| format!("cannot write {}: {error}", out.display()))?)
}

fn told(repairs: &Repairs, grid: &Grid, out: &Path) -> String {
    format!(
        "{}: {} cells and {} vertices, after {} cells were turned and {} dropped",
        out.display(),
        count(grid.cells.len() as u64),
        count(grid.positions.len() as u64),
        count(repairs.turned.len() as u64),
        count(repairs.dropped.len() as u64),
    )
}

/// What is wrong, each kind with its ids: of cells, of vertices, or the vertices of edges and faces.
fn findings(inspection: &Inspection) -> Vec<(&'static str, Vec<Value>)> {
    fn list<T: serde::Serialize>(ids: &[T]) -> Vec<Value> {
        ids.iter().map(|id| json!(id)).collect()
    }
    // Exhaustive: what is new there must be shown here.
    let Inspection {
        counts: _,
        bounds: _,
        volume: _,
        components: _,
        inside_out: _,
        inverted_cells,
        zero_volume_cells,
        zero_area_cells,
        repeated_vertex_cells,
        open_polyhedra,
        duplicate_cells,
        non_manifold_faces,
        non_manifold_edges,
        open_edges,
        miswound_edges,
        unused_vertices,
        duplicate_vertices,
    } = inspection;
    [
        ("inverted cells", list(inverted_cells)),
        ("zero-volume cells", list(zero_volume_cells)),
        ("zero-area cells", list(zero_area_cells)),
        ("cells with a repeated vertex", list(repeated_vertex_cells)),
        ("open polyhedra", list(open_polyhedra)),
        ("duplicate cells", list(duplicate_cells)),
        ("non-manifold faces", list(non_manifold_faces)),
        ("non-manifold edges", list(non_manifold_edges)),
        ("open edges", list(open_edges)),
        ("miswound edges", list(miswound_edges)),
        ("unused vertices", list(unused_vertices)),
        ("duplicate vertices", list(duplicate_vertices)),
    ]
    .into_iter()
    .filter(|(_, ids)| !ids.is_empty())
    .collect()
}

fn describe(loaded: &Loaded, inspection: &Inspection) -> String {
    let mut table = Table::of_words();
    table.row(["  vertices", &count(loaded.grid.positions.len() as u64)]);
    for (kind, number) in &inspection.counts {
        table.row([&format!("  {kind:?}"), &count(*number as u64)]);
    }
    if let Some([low, high]) = inspection.bounds {
        let corner = |p: nalgebra::Vector3<f64>| format!("{:.6} {:.6} {:.6}", p.x, p.y, p.z);
        table.row(["  box", &format!("{} to {}", corner(low), corner(high))]);
    }
    table.row(["  volume", &format!("{:.6e}", inspection.volume)]);
    table.row(["  parts", &count(inspection.components as u64)]);
    let mut text = table.to_string();
    let findings = findings(inspection);
    if inspection.inside_out {
        text += "wrong: inside-out as a whole\n";
    }
    for (what, ids) in &findings {
        text += &format!("wrong: {what}: {}\n", some(ids));
    }
    if findings.is_empty() && !inspection.inside_out {
        text += "nothing wrong\n";
    }
    for warning in &loaded.warnings {
        text += &format!("warning: {warning}\n");
    }
    text
}

fn to_json(loaded: &Loaded, inspection: &Inspection) -> Value {
    let counts: serde_json::Map<_, _> = inspection
        .counts
        .iter()
        .map(|(kind, number)| (format!("{kind:?}"), json!(number)))
        .collect();
    let wrong: serde_json::Map<_, _> = findings(inspection)
        .into_iter()
        .map(|(what, ids)| (what.to_owned(), Value::Array(ids)))
        .collect();
    json!({
        "kind": "mesh",
        "format": loaded.format.to_string(),
        "vertices": loaded.grid.positions.len(),
        "cells": counts,
        "bounds": inspection.bounds.map(|bounds| bounds.map(|corner| [corner.x, corner.y, corner.z])),
        "volume": inspection.volume,
        "components": inspection.components,
        "insideOut": inspection.inside_out,
        "wrong": wrong,
        "warnings": loaded.warnings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_tetrahedra() -> Loaded {
        let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n\
                    $EndNodes\n$Elements\n2\n1 4 0 1 2 3 4\n2 4 0 3 2 4 5\n$EndElements\n";
        mesh::parse("two.msh", text.as_bytes()).unwrap()
    }

    #[test]
    fn what_is_wrong_is_named_with_ids() {
        let mut loaded = two_tetrahedra();
        loaded.grid.positions.push(nalgebra::Vector3::zeros());
        let text = describe(&loaded, &sinew_mesh::inspect(&loaded.grid));
        assert!(text.contains("wrong: unused vertices: 5\n"), "{text}");
        assert!(
            text.contains("wrong: duplicate vertices: [5,0]\n"),
            "{text}"
        );
        let json = to_json(&loaded, &sinew_mesh::inspect(&loaded.grid));
        assert_eq!(json["wrong"]["unused vertices"], json!([5]));
        assert_eq!(json["cells"]["Tetrahedron"], 2);
    }
}
