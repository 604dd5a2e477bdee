//! Colours that tell things apart.

/// The `index`-th colour of an endless qualitative palette, as `0xRRGGBBAA`.
///
/// Hues advance by the golden angle, so that neighbours in index are far apart and no number of them repeats; lightness
/// takes three values in turn. Both are OKLCH's, in which equal steps look equal.
pub(crate) fn qualitative(index: u32) -> u32 {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653; // π (3 − √5)
    const FIRST_HUE: f64 = 4.4; // blue
    const CHROMA: f64 = 0.115; // the most that all three lightnesses have at every hue, nearly
    const LIGHTNESS: [f64; 3] = [0.72, 0.82, 0.63];
    let lightness = LIGHTNESS[index as usize % LIGHTNESS.len()];
    oklch(
        lightness,
        CHROMA,
        FIRST_HUE + f64::from(index) * GOLDEN_ANGLE,
    )
}

/// From OKLCH (hue in radians) to opaque sRGB; what lies outside of sRGB is clipped.
fn oklch(lightness: f64, chroma: f64, hue: f64) -> u32 {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    let red = 4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s;
    let green = -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s;
    let blue = -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s;
    u32::from_be_bytes([encode(red), encode(green), encode(blue), 0xff])
}

/// sRGB's transfer function.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to 0 to 255"
)]
fn encode(linear: f64) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::{oklch, qualitative};

    #[test]
    fn oklch_without_chroma_is_grey_from_black_to_white() {
        assert_eq!(oklch(0.0, 0.0, 1.0), 0x0000_00ff);
        assert_eq!(oklch(1.0, 0.0, 1.0), 0xffff_ffff);
    }

    #[test]
    fn oklch_of_pure_red_is_pure_red() {
        // sRGB red is L 0.62796, C 0.25768, h 29.234° (Ottosson, "A perceptual color space for image processing").
        assert_eq!(
            oklch(0.627_96, 0.257_68, 29.234_f64.to_radians()),
            0xff00_00ff
        );
    }

    #[test]
    fn a_hundred_colours_are_all_different() {
        let mut colours: Vec<u32> = (0..100).map(qualitative).collect();
        colours.sort_unstable();
        colours.dedup();
        assert_eq!(colours.len(), 100);
    }
}
