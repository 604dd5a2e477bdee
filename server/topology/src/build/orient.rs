//! Which cells to turn, so that neighbours wind alike.

use super::rings::{Rings, number};
use super::{BuildError, BuildReport, Pair};

/// Whether each cell is to be turned: in each component, the fewer. Empty if none is.
pub(super) fn turned(
    pairs: &[Pair],
    rings: &Rings,
    cells: usize,
    report: &mut BuildReport,
) -> Result<Vec<bool>, BuildError> {
    if !pairs.iter().any(|pair| pair.is_mirrored) {
        return Ok(Vec::new());
    }
    let turned = against_the_most(pairs, rings, cells)?;
    let cells = (0..).zip(&turned).filter(|(_, turned)| **turned);
    report.turned = cells.map(|(cell, _)| cell).collect();
    Ok(turned)
}

fn against_the_most(pairs: &[Pair], rings: &Rings, cells: usize) -> Result<Vec<bool>, BuildError> {
    let mut owner = vec![0; rings.vertex.len()];
    for cell in 0..cells {
        let first = rings.starts[rings.cells[cell] as usize] as usize;
        let end = rings.starts[rings.cells[cell + 1] as usize] as usize;
        owner[first..end].fill(number(cell));
    }
    let joined: Vec<_> = (pairs.iter())
        .map(|pair| {
            (
                pair.darts.map(|dart| owner[dart as usize]),
                pair.is_mirrored,
            )
        })
        .collect();
    duplicates(&joined)?;
    let mut starts = vec![0usize; cells + 1];
    for &([one, other], _) in &joined {
        starts[one as usize] += 1;
        starts[other as usize] += 1;
    }
    let mut sum = 0;
    for start in &mut starts {
        sum += *start;
        *start = sum;
    }
    let mut neighbours = vec![(0, false); sum];
    for &([one, other], mirrored) in &joined {
        for [from, to] in [[one, other], [other, one]] {
            starts[from as usize] -= 1;
            neighbours[starts[from as usize]] = (to, mirrored);
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; cells];
    let mut component = Vec::new();
    for cell in 0..cells {
        if turned[cell].is_some() {
            continue;
        }
        turned[cell] = Some(false);
        component.clear();
        component.push(cell);
        let mut done = 0;
        while let Some(&at) = component.get(done) {
            done += 1;
            for &(other, mirrored) in &neighbours[starts[at]..starts[at + 1]] {
                let wanted = turned[at].map(|here| here != mirrored);
                let other = other as usize;
                if turned[other].is_none() {
                    turned[other] = wanted;
                    component.push(other);
                } else if turned[other] != wanted {
                    return Err(BuildError::NotOrientable { cell: other });
                }
            }
        }
        let against = component
            .iter()
            .filter(|&&c| turned[c] == Some(true))
            .count();
        if 2 * against > component.len() {
            for &cell in &component {
                turned[cell] = turned[cell].map(|turned| !turned);
            }
        }
    }
    Ok(turned
        .into_iter()
        .map(|turned| turned == Some(true))
        .collect())
}

/// Two cells that share four faces, mirrored: the same cell twice. (A cell and its copy would make a closed space.)
fn duplicates(joined: &[([u32; 2], bool)]) -> Result<(), BuildError> {
    let mut mirrored: Vec<_> = (joined.iter())
        .filter(|(_, mirrored)| *mirrored)
        .map(|&([one, other], _)| [one.min(other), one.max(other)])
        .collect();
    mirrored.sort_unstable();
    let four = mirrored.chunk_by(|a, b| a == b).find(|same| same.len() > 3);
    match four {
        Some(same) => Err(BuildError::DuplicateCells { cells: same[0] }),
        None => Ok(()),
    }
}
