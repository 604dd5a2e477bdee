//! Polyhedra as lists of shared faces.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// How many polyhedra name a face. Without a bound, a small file could repeat a large face until memory is full.
pub(super) struct FaceUses(Vec<u8>);

impl FaceUses {
    pub(super) fn of(faces: usize) -> Self {
        Self(vec![0; faces])
    }

    /// Counts one more polyhedron at `face`, an index below the number of faces.
    pub(super) fn add(&mut self, face: usize) -> Result<(), String> {
        self.0[face] += 1;
        if self.0[face] > 2 {
            return Err("a face is named by more than two polyhedra".to_owned());
        }
        Ok(())
    }
}

/// For formats that do not promise which way faces look: turns `faces` so that neighbours run along their shared edge in opposite directions and the volume is positive.
/// Faces that meet at an edge not shared by exactly two are left as they stand to each other.
pub(super) fn turn_outward(faces: &mut [Vec<u32>], positions: &[Vector3<f64>]) {
    // Which faces use an edge, and whether along its direction from the lesser vertex to the greater.
    let mut uses: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
    for (number, face) in faces.iter().enumerate() {
        for [from, to] in edges(face) {
            let edge = [from.min(to), from.max(to)];
            uses.entry(edge).or_default().push((number, from < to));
        }
    }
    let mut turn: Vec<Option<bool>> = vec![None; faces.len()];
    for start in 0..faces.len() {
        if turn[start].is_some() {
            continue;
        }
        turn[start] = Some(false);
        let mut reached = vec![start];
        while let Some(here) = reached.pop() {
            for [from, to] in edges(&faces[here]) {
                let Some([a, b]) = uses
                    .get(&[from.min(to), from.max(to)])
                    .and_then(|uses| uses.first_chunk::<2>().filter(|_| uses.len() == 2))
                else {
                    continue;
                };
                let (there, is_alike) = (if a.0 == here { b.0 } else { a.0 }, a.1 == b.1);
                if turn[there].is_none() {
                    turn[there] = turn[here].map(|turned| turned ^ is_alike);
                    reached.push(there);
                }
            }
        }
    }
    let turned = faces.iter_mut().zip(turn);
    for (face, _) in turned.filter(|(_, turn)| *turn == Some(true)) {
        face.reverse();
    }
    if volume(faces, positions) < 0.0 {
        for face in faces {
            face.reverse();
        }
    }
}

fn edges(face: &[u32]) -> impl Iterator<Item = [u32; 2]> {
    let next = face.iter().cycle().skip(1);
    face.iter().zip(next).map(|(&from, &to)| [from, to])
}

/// Six times the volume that the faces enclose, each as the fan around its mean.
fn volume(faces: &[Vec<u32>], positions: &[Vector3<f64>]) -> f64 {
    let Some(&first) = faces.first().and_then(|face| face.first()) else {
        return 0.0;
    };
    // Relative to a vertex of the cell: far from the origin the products would cancel.
    let at = |vertex: u32| positions[vertex as usize] - positions[first as usize];
    let fan = |face: &Vec<u32>| {
        let sum: Vector3<f64> = face.iter().map(|&vertex| at(vertex)).sum();
        let centre = sum / face.len().max(1) as f64;
        let six_times = |[from, to]: [u32; 2]| at(from).cross(&at(to)).dot(&centre);
        edges(face).map(six_times).sum::<f64>()
    };
    faces.iter().map(fan).sum()
}
