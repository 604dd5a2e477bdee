//! The contact sheet: pictures side by side, with words below.

use std::{fs::File, io::BufWriter, path::Path};

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use super::picture::{Light, Picture};
use crate::Failure;

const MARGIN: usize = 16;
const TITLE: Style = Style {
    weight: FontWeight::Bold,
    height: RasterHeight::Size24,
    ink: 0.02,
};
const LABEL: Style = Style {
    weight: FontWeight::Bold,
    height: RasterHeight::Size16,
    ink: 0.03,
};
const FIGURE: Style = Style {
    weight: FontWeight::Regular,
    height: RasterHeight::Size16,
    ink: 0.12,
};
/// Lines of words below a picture, and the space that they take.
const LINES: usize = 3;
const WORDS: usize = LINES * 19 + 8;

#[derive(Clone, Copy)]
struct Style {
    weight: FontWeight,
    height: RasterHeight,
    /// Grey, 0 for black to 1.
    ink: f32,
}

impl Style {
    fn width(self) -> usize {
        get_raster_width(self.weight, self.height)
    }
}

/// A picture and what stands below it.
pub(crate) struct Cell {
    pub(crate) picture: Picture,
    pub(crate) label: String,
    pub(crate) figures: [String; LINES - 1],
}

/// Puts cells of one size in rows.
///
/// # Panics
/// If there is no cell.
pub(crate) fn sheet(title: &str, columns: usize, cells: &[Cell]) -> Picture {
    let [width, height] = cells[0].picture.size;
    let top = 2 * MARGIN + TITLE.height.val();
    let size = [
        MARGIN + columns * (width + MARGIN),
        top + cells.len().div_ceil(columns) * (height + WORDS + MARGIN),
    ];
    let mut sheet = Picture {
        size,
        pixels: vec![[1.0; 3]; size[0] * size[1]],
    };
    write(
        &mut sheet,
        title,
        [MARGIN, MARGIN],
        size[0] - 2 * MARGIN,
        TITLE,
    );
    for (index, cell) in cells.iter().enumerate() {
        let left = MARGIN + index % columns * (width + MARGIN);
        let top = top + index / columns * (height + WORDS + MARGIN);
        for (y, row) in cell.picture.pixels.chunks(width).enumerate() {
            let start = (top + y) * size[0] + left;
            sheet.pixels[start..start + width].copy_from_slice(row);
        }
        let below = top + height + 6;
        write(&mut sheet, &cell.label, [left, below], width, LABEL);
        for (line, figure) in (1..).zip(&cell.figures) {
            write(&mut sheet, figure, [left, below + 19 * line], width, FIGURE);
        }
    }
    sheet
}

/// Writes a line; what does not fit into the width is cut off with dots.
fn write(on: &mut Picture, text: &str, [left, top]: [usize; 2], width: usize, style: Style) {
    let fits = width / style.width();
    let short = text.chars().count() <= fits;
    let shown = if short { fits } else { fits.saturating_sub(3) };
    let dots = if short { "" } else { "..." };
    for (place, letter) in text.chars().take(shown).chain(dots.chars()).enumerate() {
        let raster = get_raster(letter, style.weight, style.height)
            .or_else(|| get_raster('?', style.weight, style.height))
            .expect("the font has a question mark");
        for (y, row) in raster.rows().enumerate() {
            let start = (top + y) * on.size[0] + left + place * style.width();
            for (pixel, cover) in on.pixels[start..].iter_mut().zip(row.iter()) {
                let cover = f32::from(*cover) / 255.0;
                for part in pixel {
                    *part += cover * (style.ink - *part);
                }
            }
        }
    }
}

/// Writes a picture as PNG.
///
/// # Errors
/// Where the file cannot be written.
pub(crate) fn save(picture: &Picture, path: &Path) -> Result<(), Failure> {
    let file =
        File::create(path).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    let [width, height] = picture.size;
    let mut encoder = png::Encoder::new(
        BufWriter::new(file),
        u32::try_from(width)?,
        u32::try_from(height)?,
    );
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let bytes: Vec<u8> = picture.pixels.iter().flat_map(encoded).collect();
    encoder.write_header()?.write_image_data(&bytes)?;
    Ok(())
}

/// As sRGB shows linear light, nearly: by its mean exponent.
pub(super) fn encoded(light: &Light) -> [u8; 3] {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0 to 255"
    )]
    light.map(|part| (255.0 * part.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(label: &str) -> Cell {
        Cell {
            picture: Picture {
                size: [60, 10],
                pixels: vec![[0.5; 3]; 600],
            },
            label: label.to_owned(),
            figures: ["".to_owned(), "".to_owned()],
        }
    }

    #[test]
    fn cells_stand_in_rows_and_words_stay_in_their_cells() {
        let cells = [
            cell("a label far too long for so small a picture"),
            cell("b"),
            cell("c"),
        ];
        let sheet = sheet("Title", 2, &cells);
        let [width, height] = sheet.size;
        assert_eq!(width, MARGIN + 2 * (60 + MARGIN));
        assert_eq!(sheet.pixels.len(), width * height);
        let grey = sheet
            .pixels
            .iter()
            .filter(|pixel| **pixel == [0.5; 3])
            .count();
        assert!(grey >= 3 * 600);
        let between = |row: &[Light]| {
            row[MARGIN + 60..MARGIN + 60 + MARGIN]
                .iter()
                .all(|p| *p == [1.0; 3])
        };
        let below_title = (2 * MARGIN + TITLE.height.val()) * width;
        assert!(sheet.pixels[below_title..].chunks(width).all(between));
    }
}
