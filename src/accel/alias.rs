//! Choosing one of many by a table: Walker's alias method.

/// Entries (threshold, other entry, chance, id), the integers as bits: entry i with a second number
/// below the threshold gives i, else the other entry.
pub fn alias(choices: &[(u32, f64)]) -> Vec<[f32; 4]> {
    let n = choices.len();
    let mut scaled: Vec<f64> = choices.iter().map(|c| c.1 * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    let mut other: Vec<usize> = (0..n).collect();
    let mut threshold = vec![1.0; n];
    while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
        small.pop();
        threshold[s] = scaled[s];
        other[s] = l;
        scaled[l] -= 1.0 - scaled[s];
        if scaled[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    (0..n)
        .map(|i| {
            [threshold[i] as f32, f32::from_bits(other[i] as u32), choices[i].1 as f32, f32::from_bits(choices[i].0)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alias_tables_hold_the_chances() {
        let chances = [0.5, 0.25, 0.125, 0.1, 0.025, 0.0];
        let table = alias(&chances.iter().enumerate().map(|(i, &p)| (i as u32, p)).collect::<Vec<_>>());
        let mut got = [0.0; 6];
        for (i, entry) in table.iter().enumerate() {
            got[i] += f64::from(entry[0]) / 6.0;
            got[entry[1].to_bits() as usize] += (1.0 - f64::from(entry[0])) / 6.0;
        }
        for (g, p) in got.iter().zip(chances) {
            assert!((g - p).abs() < 1e-6, "{got:?}");
        }
        assert!(alias(&[]).is_empty());
    }
}
