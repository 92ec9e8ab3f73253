//! How many rays methods send that gather: what the slider offers, and how numbers of rays are read.

/// Shares that the slider offers; each is about √2 of the one before.
pub const SHARES: [f32; 7] = [0.125, 1.0 / 6.0, 0.25, 1.0 / 3.0, 0.5, 2.0 / 3.0, 1.0];
const NAMES: [&str; 7] = ["1/8", "1/6", "1/4", "1/3", "1/2", "2/3", "all"];

/// What `gather::Options::rays` can be; all where `rays` cannot.
pub fn checked(rays: f32) -> f32 {
    if rays > 0.0 && rays <= 16_777_216.0 { rays } else { 1.0 }
}

/// The place among [`SHARES`] that is nearest to `rays`.
pub fn nearest(rays: f32) -> usize {
    let apart = |i: &usize| (rays / SHARES[*i]).ln().abs();
    (0..SHARES.len()).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(SHARES.len() - 1)
}

/// What is asked for, in words.
pub fn share(rays: f32) -> String {
    match NAMES.iter().zip(SHARES).find(|(_, share)| *share == rays) {
        Some((name, _)) => (*name).into(),
        None if rays > 1.0 => count(rays.into()),
        None => format!("{:.2}", rays),
    }
}

/// A number of rays, no more digits than are worth reading.
pub fn count(rays: f64) -> String {
    match rays {
        n if n < 999.5 => format!("{n:.0}"),
        n if n < 9_950.0 => format!("{:.1} k", n / 1e3),
        n if n < 999_500.0 => format!("{:.0} k", n / 1e3),
        n => format!("{:.1} M", n / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_numbers_are_told_in_few_letters() {
        for (i, rays) in SHARES.into_iter().enumerate() {
            assert_eq!((nearest(rays), share(rays).as_str(), checked(rays)), (i, NAMES[i], rays));
        }
        assert_eq!([0.01, 0.4, 40_000.0].map(nearest), [0, 3, 6]);
        assert_eq!([0.4, 40_000.0].map(share), ["0.40", "40 k"]);
        assert_eq!([0.0, f32::NAN, f32::INFINITY].map(checked), [1.0; 3]);
        assert_eq!([640.0, 999.9, 4_120.0, 41_234.0, 999_600.0].map(count), ["640", "1.0 k", "4.1 k", "41 k", "1.0 M"]);
    }
}
