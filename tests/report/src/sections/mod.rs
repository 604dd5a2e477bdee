//! The sections, in the order of the page.

mod capture;
mod drift;
mod elastic;
mod fits;
mod flood;
mod hard;
mod mapping;
mod oriented;
mod paper;
mod particles;
mod precision;
mod presets;
mod rbf;
mod scaling;
mod topology;

use crate::section::Section;

pub(crate) const ALL: [Section; 15] = [
    mapping::SECTION,
    presets::SECTION,
    rbf::SECTION,
    fits::SECTION,
    flood::SECTION,
    hard::SECTION,
    drift::SECTION,
    capture::SECTION,
    precision::SECTION,
    scaling::SECTION,
    particles::SECTION,
    oriented::SECTION,
    elastic::SECTION,
    topology::SECTION,
    paper::SECTION,
];
