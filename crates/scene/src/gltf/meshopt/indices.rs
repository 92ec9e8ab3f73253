//! Modes TRIANGLES and INDICES.

use super::Stream;

/// The latest sixteen values; entry 0 is the youngest.
struct Fifo<T> {
    entries: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn new() -> Self {
        Self { entries: [None; 16], next: 0 }
    }

    fn push(&mut self, value: T) {
        self.entries[self.next] = Some(value);
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, age: u8) -> Result<T, String> {
        let at = (self.next + 15 - usize::from(age)) % 16;
        self.entries[at].ok_or_else(|| "refers to something before its beginning".to_owned())
    }
}

fn zigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

/// What the decoder of triangles remembers.
struct Triangles<'a> {
    stream: Stream<'a>,
    /// The first index that was not used yet.
    next: u32,
    /// The latest index that was written out.
    last: u32,
    edges: Fifo<(u32, u32)>,
    vertices: Fifo<u32>,
}

impl Triangles<'_> {
    fn fresh(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    fn explicit(&mut self) -> Result<u32, String> {
        let delta = zigzag(self.stream.number()?);
        self.last = self.last.wrapping_add(delta);
        Ok(self.last)
    }

    /// A corner by four bits: 0 a fresh index, 15 a written one, else one of the latest.
    fn corner(&mut self, bits: u8) -> Result<u32, String> {
        match bits {
            0 => Ok(self.fresh()),
            15 => self.explicit(),
            age => self.vertices.get(age - 1),
        }
    }

    fn triangle(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let (a, b) = self.edges.get(high)?;
            let c = match low {
                0 => self.fresh(),
                1..=12 => self.vertices.get(low)?,
                13 | 14 => {
                    self.last = if low == 13 { self.last.wrapping_sub(1) } else { self.last.wrapping_add(1) };
                    self.last
                }
                _ => self.explicit()?,
            };
            self.edges.push((c, b));
            self.edges.push((a, c));
            if !(1..=12).contains(&low) {
                self.vertices.push(c);
            }
            return Ok([a, b, c]);
        }
        let corners = if low < 14 {
            table[usize::from(low)]
        } else {
            let corners = self.stream.byte()?;
            if corners == 0 {
                self.next = 0;
            }
            corners
        };
        let a = if low == 15 { self.explicit()? } else { self.fresh() };
        let (bits_b, bits_c) = (corners >> 4, corners & 15);
        let b = self.corner(bits_b)?;
        let c = self.corner(bits_c)?;
        self.edges.push((b, a));
        self.edges.push((c, b));
        self.edges.push((a, c));
        self.vertices.push(a);
        for (bits, vertex) in [(bits_b, b), (bits_c, c)] {
            if matches!(bits, 0 | 15) {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }
}

/// Mode TRIANGLES: `count` indices.
pub(super) fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if data.first() != Some(&0xe1) {
        return Err("does not begin with 0xe1".to_owned());
    }
    if !count.is_multiple_of(3) {
        return Err(format!("{count} indices do not make whole triangles"));
    }
    let mut stream = Stream { data: &data[1..] };
    let codes = stream.take(count / 3)?;
    let body = stream.data.len().checked_sub(16).ok_or("ends too early")?;
    let (body, table) = stream.data.split_at(body);
    if table[14..] != [0, 0] || table.iter().any(|t| t >> 4 == 15 || t & 15 == 15) {
        return Err("has an impossible table at its end".to_owned());
    }
    let stream = Stream { data: body };
    let mut state = Triangles { stream, next: 0, last: 0, edges: Fifo::new(), vertices: Fifo::new() };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        out.extend(state.triangle(code, table)?);
    }
    state.stream.end()?;
    Ok(out)
}

/// Mode INDICES: `count` indices.
pub(super) fn sequence(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if data.first() != Some(&0xd1) {
        return Err("does not begin with 0xd1".to_owned());
    }
    let body = data.len().checked_sub(5).ok_or("ends too early")?;
    if count > body {
        return Err("ends too early".to_owned());
    }
    let mut stream = Stream { data: &data[1..=body] };
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let v = stream.number()?;
        let base = &mut last[(v & 1) as usize];
        *base = base.wrapping_add(zigzag(v >> 1));
        out.push(*base);
    }
    stream.end()?;
    Ok(out)
}
