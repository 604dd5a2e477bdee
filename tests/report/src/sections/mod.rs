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
mod tearing;
mod threads;
mod topology;
mod ways;

use crate::section::Section;

pub(crate) const ALL: [Section; 18] = [
    mapping::SECTION,
    presets::SECTION,
    rbf::SECTION,
    fits::SECTION,
    flood::SECTION,
    ways::SECTION,
    hard::SECTION,
    drift::SECTION,
    capture::SECTION,
    precision::SECTION,
    scaling::SECTION,
    threads::SECTION,
    particles::SECTION,
    oriented::SECTION,
    elastic::SECTION,
    topology::SECTION,
    tearing::SECTION,
    paper::SECTION,
];
