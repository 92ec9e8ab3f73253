//! What metrics take: RGB pixels that were checked once.

use thiserror::Error;

/// Why two pictures cannot be compared.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MetricError {
    /// The number of values is not `3 · width · height` (of a layer: a multiple of its pixels), or
    /// there is no pixel.
    #[error("picture `{picture}` has {values} values, which do not make {width}×{height} pixels")]
    Shape {
        /// Name given by the caller.
        picture: String,
        /// Claimed width.
        width: usize,
        /// Claimed height.
        height: usize,
        /// Values there are.
        values: usize,
    },
    /// NaN or infinity, which no metric means anything for.
    #[error("picture `{picture}` holds {count} non-finite values, the first at x {x}, y {y}, channel {channel}")]
    NonFinite {
        /// Name given by the caller.
        picture: String,
        /// Column of the first one.
        x: usize,
        /// Row of the first one.
        y: usize,
        /// R, G or B of the first one.
        channel: char,
        /// How many there are.
        count: usize,
    },
    /// The pictures have different sizes.
    #[error("`{a}` is {a_width}×{a_height} pixels and `{b}` is {b_width}×{b_height}; metrics need one size")]
    Sizes {
        /// Name of the first.
        a: String,
        /// Its width.
        a_width: usize,
        /// Its height.
        a_height: usize,
        /// Name of the second.
        b: String,
        /// Its width.
        b_width: usize,
        /// Its height.
        b_height: usize,
    },
    /// Too few pixels for a window or a covariance.
    #[error("{metric} needs pictures of at least {least}, not {width}×{height}")]
    TooSmall {
        /// The metric.
        metric: &'static str,
        /// What it needs, in words.
        least: &'static str,
        /// Width there is.
        width: usize,
        /// Height there is.
        height: usize,
    },
    /// FLIP was asked for a viewing distance that nobody has.
    #[error("{given} pixels per degree; FLIP takes more than 0 and at most {most}",
        most = super::flip::MAX_PIXELS_PER_DEGREE)]
    PixelsPerDegree {
        /// What was asked for.
        given: f32,
    },
}

impl MetricError {
    /// [`Self::Sizes`] of name, width and height.
    pub fn sizes(a: (&str, usize, usize), b: (&str, usize, usize)) -> Self {
        let ((a, a_width, a_height), (b, b_width, b_height)) = (a, b);
        Self::Sizes { a: a.into(), a_width, a_height, b: b.into(), b_width, b_height }
    }
}

/// RGB pixels, interleaved, rows from the top; finite by construction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture<'a> {
    name: &'a str,
    width: usize,
    height: usize,
    pixels: &'a [f32],
}

impl<'a> Picture<'a> {
    /// Checks `3 · width · height` values. `name` is for messages: a file or layer name.
    ///
    /// # Errors
    /// [`MetricError::Shape`] and [`MetricError::NonFinite`].
    pub fn new(name: &'a str, width: usize, height: usize, pixels: &'a [f32]) -> Result<Self, MetricError> {
        if pixels.is_empty() || width.checked_mul(height).and_then(|n| n.checked_mul(3)) != Some(pixels.len()) {
            return Err(MetricError::Shape { picture: name.into(), width, height, values: pixels.len() });
        }
        if let Some(first) = pixels.iter().position(|v| !v.is_finite()) {
            return Err(MetricError::NonFinite {
                picture: name.into(),
                x: first / 3 % width,
                y: first / 3 / width,
                channel: ['R', 'G', 'B'][first % 3],
                count: pixels.iter().filter(|v| !v.is_finite()).count(),
            });
        }
        Ok(Self { name, width, height, pixels })
    }

    /// Name for messages.
    pub fn name(&self) -> &'a str {
        self.name
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// `3 · width · height` values.
    pub fn pixels(&self) -> &'a [f32] {
        self.pixels
    }

    /// One channel (0 to 2) as f64.
    pub(super) fn channel(&self, channel: usize) -> Vec<f64> {
        self.pixels.iter().skip(channel).step_by(3).map(|&v| f64::from(v)).collect()
    }

    /// Refuses two different sizes.
    pub(super) fn same_size(&self, other: &Picture<'_>) -> Result<(), MetricError> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(MetricError::sizes((self.name, self.width, self.height), (other.name, other.width, other.height)))
    }
}
