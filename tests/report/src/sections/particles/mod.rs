//! Particles: integrators against laws, time against size, and another program on the same particles.

mod melt;
mod orders;

use crate::section::{Failure, Findings, Section};

pub(crate) const SECTION: Section = Section {
    name: "particles",
    title: "Particles: time against error and size",
    measure,
};

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    orders::measure(&mut findings)?;
    melt::scaling(&mut findings)?;
    let beside = melt::beside_lammps(&mut findings);
    findings.peers(beside);
    Ok(findings)
}
