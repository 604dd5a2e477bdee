//! The sections, in the order of the page.

mod drift;
mod hard;
mod mapping;
mod paper;
mod precision;
mod rbf;
mod scaling;

use crate::section::Section;

pub(crate) const ALL: [Section; 7] = [
    mapping::SECTION,
    rbf::SECTION,
    hard::SECTION,
    drift::SECTION,
    precision::SECTION,
    scaling::SECTION,
    paper::SECTION,
];
