//! Particles: integrators against laws, time against size, and another program on the same particles.

mod melt;
mod orders;
mod single;

use crate::section::{Failure, Findings, Section};

pub(crate) const SECTION: Section = Section {
    name: "particles",
    title: "Particles: time against error and size",
    measure,
};

/// Particles of the melt on which single precision is tried.
const SINGLE: u32 = 32_000;

fn measure() -> Result<Findings, Failure> {
    let mut findings = Findings::default();
    orders::measure(&mut findings)?;
    melt::scaling(&mut findings)?;
    single::measure(&mut findings, &melt::stirred(SINGLE)?)?;
    let beside = melt::beside_lammps(&mut findings);
    findings.peers(beside);
    Ok(findings)
}
