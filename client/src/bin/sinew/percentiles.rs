//! What most values stay under.

/// The value that a share of all values does not exceed: the nearest-rank percentile. `None` of no values.
///
/// * `share` - 0 to 1; 0.5 is the median.
pub(crate) fn percentile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length is a rank within it; `as` saturates"
    )]
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_1_to_100_are_themselves() {
        let mut values: Vec<f64> = (1..=100).map(f64::from).collect();
        values.reverse();
        for share in [1, 50, 99, 100] {
            let found = percentile(&values, f64::from(share) / 100.0);
            assert_eq!(found, Some(f64::from(share)));
        }
        assert_eq!(percentile(&values, 0.0), Some(1.0));
    }

    #[test]
    fn one_value_is_every_percentile_and_none_has_none() {
        assert_eq!(percentile(&[3.0], 0.5), Some(3.0));
        assert_eq!(percentile(&[3.0], 0.99), Some(3.0));
        assert_eq!(percentile(&[], 0.5), None);
    }
}
