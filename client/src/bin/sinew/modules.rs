//! Simulated particles and links, one line each.

use sinew_client::Client;
use sinew_proto::v1::{
    Indices, LinkModules, LinkSelection, Modules, Precision, ReadModulesRequest, Reals,
};

use crate::{
    Failure,
    out::put,
    table::{Table, count},
};

/// Reads `BATCH` or `BATCH:INDEX,INDEX`.
pub(crate) fn links(text: &str) -> Result<LinkSelection, String> {
    let (batch, links) = text.split_once(':').unwrap_or((text, ""));
    let index = |text: &str| {
        let fault = |_| format!("`{text}` is no index; write a batch, or BATCH:INDEX,INDEX");
        text.parse().map_err(fault)
    };
    let links: Vec<u32> = match links {
        "" => Vec::new(),
        links => links.split(',').map(index).collect::<Result<_, _>>()?,
    };
    Ok(LinkSelection {
        batch: index(batch)?,
        links: Some(Indices::pack(&links)),
    })
}

/// Reads modules of a session, all where none is named, and prints them.
pub(crate) async fn read(
    client: &Client,
    name: String,
    particles: &[u32],
    links: Vec<LinkSelection>,
) -> Result<(), Failure> {
    let request = ReadModulesRequest {
        name,
        particles: Some(Indices::pack(particles)),
        links,
        precision: Precision::F64.into(),
    };
    put!("{}", told(&client.read_modules(request).await?)?);
    Ok(())
}

/// A table of the particles and one of each batch of links.
fn told(modules: &Modules) -> Result<String, Failure> {
    let Modules {
        step,
        time_seconds,
        particles,
        positions,
        velocities,
        forces,
        torques: _,
        links,
    } = modules;
    let mut text = format!("step {}  time {time_seconds:.3} s\n", count(*step));
    let particles = indices(particles.as_ref())?;
    if !particles.is_empty() {
        let mut table = Table::of_numbers();
        table.row(["particle", "position, m", "velocity, m/s", "force, N"]);
        let columns = [positions, velocities, forces].map(|column| vectors(column.as_ref()));
        let [positions, velocities, forces] = columns;
        let columns = positions?.into_iter().zip(velocities?).zip(forces?);
        for (particle, ((position, velocity), force)) in particles.iter().zip(columns) {
            let vectors = [position, velocity, force].map(vector);
            table.row([particle.to_string()].into_iter().chain(vectors));
        }
        text += &format!("\n{table}");
    }
    for links in links {
        text += &format!("\n{}", of_batch(links)?);
    }
    Ok(text)
}

fn of_batch(links: &LinkModules) -> Result<Table, Failure> {
    let LinkModules {
        batch,
        links,
        ends,
        forces,
        broken,
    } = links;
    let mut table = Table::of_numbers();
    table.row(["link", "from", "to", "force on the second, N", "size, N"]);
    let broken = indices(broken.as_ref())?;
    let ends = indices(ends.as_ref())?;
    let columns = ends
        .as_chunks::<2>()
        .0
        .iter()
        .zip(vectors(forces.as_ref())?);
    for (link, ([from, to], force)) in indices(links.as_ref())?.iter().zip(columns) {
        let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let size = match broken.contains(link) {
            true => "broken".to_owned(),
            false => format!("{size:.4}"),
        };
        table.row([
            format!("{batch}:{link}"),
            from.to_string(),
            to.to_string(),
            vector(force),
            size,
        ]);
    }
    Ok(table)
}

fn indices(column: Option<&Indices>) -> Result<Vec<u32>, Failure> {
    Ok(column.map(Indices::unpack).transpose()?.unwrap_or_default())
}

fn vectors(column: Option<&Reals>) -> Result<Vec<[f64; 3]>, Failure> {
    let numbers = column.map(Reals::unpack).transpose()?.unwrap_or_default();
    Ok(numbers.as_chunks::<3>().0.to_vec())
}

fn vector([x, y, z]: [f64; 3]) -> String {
    format!("({x:.4}, {y:.4}, {z:.4})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_named_by_batch_and_index() {
        let of =
            |text| links(text).map(|links| (links.batch, links.links.unwrap().unpack().unwrap()));
        assert_eq!(of("2"), Ok((2, vec![])));
        assert_eq!(of("0:3,7"), Ok((0, vec![3, 7])));
        let refused = of("0:x").unwrap_err();
        assert_eq!(
            refused,
            "`x` is no index; write a batch, or BATCH:INDEX,INDEX"
        );
    }

    #[test]
    fn particles_and_links_stand_in_tables_with_what_is_broken() {
        let reals = |numbers: &[f64]| Some(Reals::pack(numbers, Precision::F64));
        let modules = Modules {
            step: 1200,
            time_seconds: 2.4,
            particles: Some(Indices::pack(&[3])),
            positions: reals(&[0.0, 0.0, -1.5]),
            velocities: reals(&[0.0; 3]),
            forces: reals(&[0.0, 0.0, 0.981]),
            torques: None,
            links: vec![LinkModules {
                batch: 1,
                links: Some(Indices::pack(&[0, 4])),
                ends: Some(Indices::pack(&[0, 1, 4, 5])),
                forces: reals(&[0.0, 3.0, 4.0, 0.0, 0.0, 0.0]),
                broken: Some(Indices::pack(&[4])),
            }],
        };
        assert_eq!(
            told(&modules).unwrap(),
            "step 1,200  time 2.400 s\n\
             \n\
             particle                position, m             velocity, m/s                  force, N\n\
             3         (0.0000, 0.0000, -1.5000)  (0.0000, 0.0000, 0.0000)  (0.0000, 0.0000, 0.9810)\n\
             \n\
             link  from  to    force on the second, N  size, N\n\
             1:0      0   1  (0.0000, 3.0000, 4.0000)   5.0000\n\
             1:4      4   5  (0.0000, 0.0000, 0.0000)   broken\n"
        );
    }
}
