//! Small changes of a scene as text: what the viewer does to lights and objects, and
//! `bouncelight render` repeats.
//!
//! A light: `INDEX key=value …` with the keys `color`, `strength` (W/m² of a sun, W/sr of other
//! lights), `direction`, `position` and `size` (angle of a sun in radians, radius of other lights
//! in metres). With `kind=sun`, `point` or `spot` and the number after the last one, a light is
//! added. An object: `INDEX x,y,z`, metres by which it is moved from where the file has it.
//! Numbers are written so that they read back bit for bit.

use bouncelight::scene::{Light, LightKind, SUN_ANGLE, Scene};
use std::{fmt, str::FromStr};
use thiserror::Error;

/// What a light that is added is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewLight {
    /// A sun from above, 1 W/m².
    Sun,
    /// A ball of 2 cm at the origin, 1 W/sr.
    Point,
    /// The same, into a cone of 30° straight down that fades from 20° on.
    Spot,
}

impl NewLight {
    /// All of them.
    pub const ALL: [NewLight; 3] = [NewLight::Sun, NewLight::Point, NewLight::Spot];

    /// The word for it.
    pub fn name(self) -> &'static str {
        ["sun", "point", "spot"][self as usize]
    }

    /// The light, to be changed by the rest of an edit.
    fn light(self) -> Light {
        let (position, direction, intensity, radius, range) = ([0.0; 3], [0.0, -1.0, 0.0], 1.0, 0.02, None);
        let kind = match self {
            NewLight::Sun => LightKind::Directional { direction, irradiance: 1.0, angle: SUN_ANGLE },
            NewLight::Point => LightKind::Point { position, intensity, radius, range },
            NewLight::Spot => {
                let (inner_angle, outer_angle) = (20f32.to_radians(), 30f32.to_radians());
                LightKind::Spot { position, direction, intensity, radius, range, inner_angle, outer_angle }
            }
        };
        Light { name: "added".into(), ..kind.into() }
    }
}

/// A light as it is after the change.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightEdit {
    /// Index into [`Scene::lights`].
    pub light: usize,
    /// It is added, as the last one.
    pub kind: Option<NewLight>,
    /// Linear tint.
    pub color: Option<[f32; 3]>,
    /// W/m² (sun) or W/sr.
    pub strength: Option<f32>,
    /// Along which light travels.
    pub direction: Option<[f32; 3]>,
    /// Metres.
    pub position: Option<[f32; 3]>,
    /// Radians (sun) or metres.
    pub size: Option<f32>,
}

/// An object moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectEdit {
    /// Index into [`Scene::instances`].
    pub object: usize,
    /// From where the file has it, metres.
    pub by: [f32; 3],
}

/// Why a change cannot be read or made.
#[derive(Debug, Error, PartialEq)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum EditError {
    /// No such word.
    #[error("`{word}` in `{text}`: {reason}")]
    Word { text: String, word: String, reason: &'static str },
    /// The scene has fewer.
    #[error("the scene has {count} {what}s, so there is no number {index}")]
    Missing { what: &'static str, index: usize, count: usize },
    /// A light of this kind has no such property.
    #[error("light {light} is a {kind} and has no {key}")]
    NoSuchKey { light: usize, kind: &'static str, key: &'static str },
}

impl LightEdit {
    /// What has to be said to add `light` as number `index`, which is as [`NewLight`] has it but
    /// for what can be changed.
    pub fn added(index: usize, light: &Light) -> Self {
        let kind = match light.kind {
            LightKind::Directional { .. } => NewLight::Sun,
            LightKind::Point { .. } => NewLight::Point,
            LightKind::Spot { .. } => NewLight::Spot,
        };
        Self { kind: Some(kind), ..Self::of(index, light) }
    }

    /// What has to be said of light number `light` to turn `from` into `to`, which is of the same
    /// kind; `None` for nothing.
    pub fn between(light: usize, from: &Light, to: &Light) -> Option<Self> {
        let (a, b) = (Self::of(light, from), Self::of(light, to));
        let edit = Self {
            light,
            kind: None,
            color: b.color.filter(|_| a.color != b.color),
            strength: b.strength.filter(|_| a.strength != b.strength),
            direction: b.direction.filter(|_| a.direction != b.direction),
            position: b.position.filter(|_| a.position != b.position),
            size: b.size.filter(|_| a.size != b.size),
        };
        (edit != Self { light, ..Self::default() }).then_some(edit)
    }

    /// Everything of `light` that can be changed.
    pub fn of(index: usize, light: &Light) -> Self {
        let edit = Self { light: index, color: Some(light.color), ..Self::default() };
        match light.kind {
            LightKind::Directional { direction, irradiance, angle } => {
                Self { direction: Some(direction), strength: Some(irradiance), size: Some(angle), ..edit }
            }
            LightKind::Point { position, intensity, radius, .. } => {
                Self { position: Some(position), strength: Some(intensity), size: Some(radius), ..edit }
            }
            LightKind::Spot { position, direction, intensity, radius, .. } => Self {
                position: Some(position),
                direction: Some(direction),
                strength: Some(intensity),
                size: Some(radius),
                ..edit
            },
        }
    }

    /// Changes the light.
    ///
    /// # Errors
    /// No such light, or it has no such property; then nothing has changed.
    pub fn apply(&self, scene: &mut Scene) -> Result<(), EditError> {
        if let Some(kind) = self.kind.filter(|_| self.light == scene.lights.len()) {
            scene.lights.push(kind.light());
            let done = Self { kind: None, ..self.clone() }.apply(scene);
            if done.is_err() {
                scene.lights.pop();
            }
            return done;
        }
        let count = scene.lights.len();
        let light =
            scene.lights.get_mut(self.light).ok_or(EditError::Missing { what: "light", index: self.light, count })?;
        let no = |kind, key| Err(EditError::NoSuchKey { light: self.light, kind, key });
        match (&light.kind, self.direction, self.position) {
            (LightKind::Directional { .. }, _, Some(_)) => return no("sun", "position"),
            (LightKind::Point { .. }, Some(_), _) => return no("point light", "direction"),
            _ => {}
        }
        light.color = self.color.unwrap_or(light.color);
        let set = |place: &mut f32, value: Option<f32>| *place = value.unwrap_or(*place);
        let set3 = |place: &mut [f32; 3], value: Option<[f32; 3]>| *place = value.unwrap_or(*place);
        match &mut light.kind {
            LightKind::Directional { direction, irradiance, angle } => {
                set3(direction, self.direction);
                set(irradiance, self.strength);
                set(angle, self.size);
            }
            LightKind::Point { position, intensity, radius, .. } => {
                set3(position, self.position);
                set(intensity, self.strength);
                set(radius, self.size);
            }
            LightKind::Spot { position, direction, intensity, radius, .. } => {
                set3(position, self.position);
                set3(direction, self.direction);
                set(intensity, self.strength);
                set(radius, self.size);
            }
        }
        Ok(())
    }
}

impl ObjectEdit {
    /// Moves the object.
    ///
    /// # Errors
    /// No such object.
    pub fn apply(&self, scene: &mut Scene) -> Result<(), EditError> {
        let count = scene.instances.len();
        let instance = scene.instances.get_mut(self.object).ok_or(EditError::Missing {
            what: "object",
            index: self.object,
            count,
        })?;
        for (place, by) in instance.transform[3].iter_mut().zip(self.by) {
            *place += by;
        }
        Ok(())
    }
}

impl fmt::Display for LightEdit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.light)?;
        let three = |v: [f32; 3]| format!("{},{},{}", v[0], v[1], v[2]);
        let words = [
            ("kind", self.kind.map(|k| k.name().to_owned())),
            ("color", self.color.map(three)),
            ("strength", self.strength.map(|v| v.to_string())),
            ("direction", self.direction.map(three)),
            ("position", self.position.map(three)),
            ("size", self.size.map(|v| v.to_string())),
        ];
        words.into_iter().try_for_each(|(key, value)| value.map_or(Ok(()), |v| write!(f, " {key}={v}")))
    }
}

impl fmt::Display for ObjectEdit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.by;
        write!(f, "{} {x},{y},{z}", self.object)
    }
}

fn number(text: &str, word: &str) -> Result<f32, EditError> {
    let wrong = |reason| EditError::Word { text: text.into(), word: word.into(), reason };
    let value: f32 = word.parse().map_err(|_| wrong("is not a number"))?;
    if value.is_finite() { Ok(value) } else { Err(wrong("is not a finite number")) }
}

fn three(text: &str, word: &str) -> Result<[f32; 3], EditError> {
    let numbers = word.split(',').map(|w| number(text, w)).collect::<Result<Vec<_>, _>>()?;
    let reason = "needs three numbers, such as 1,2,3";
    numbers.try_into().map_err(|_| EditError::Word { text: text.into(), word: word.into(), reason })
}

fn index(text: &str, word: Option<&str>) -> Result<usize, EditError> {
    let word = word.unwrap_or("");
    let reason = "must begin with the number that the viewer shows";
    word.parse().map_err(|_| EditError::Word { text: text.into(), word: word.into(), reason })
}

impl FromStr for LightEdit {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        let mut words = text.split_whitespace();
        let mut edit = Self { light: index(text, words.next())?, ..Self::default() };
        for word in words {
            let wrong = |reason| EditError::Word { text: text.into(), word: word.into(), reason };
            let (key, value) = word.split_once('=').ok_or_else(|| wrong("must be written as key=value"))?;
            let not_negative = |v: f32| if v < 0.0 { Err(wrong("must not be negative")) } else { Ok(v) };
            match key {
                "kind" => {
                    let kind = NewLight::ALL.into_iter().find(|k| k.name() == value);
                    edit.kind =
                        Some(kind.ok_or_else(|| wrong("is not a kind of light; there are sun, point and spot"))?);
                }
                "color" => {
                    let color = three(text, value)?;
                    color.into_iter().try_for_each(|v| not_negative(v).map(|_| ()))?;
                    edit.color = Some(color);
                }
                "strength" => edit.strength = Some(not_negative(number(text, value)?)?),
                "size" => edit.size = Some(not_negative(number(text, value)?)?),
                "direction" => {
                    let direction = three(text, value)?;
                    if glam::Vec3::from(direction).try_normalize().is_none() {
                        return Err(wrong("points nowhere"));
                    }
                    edit.direction = Some(direction);
                }
                "position" => edit.position = Some(three(text, value)?),
                _ => return Err(wrong("is unknown; there are kind, color, strength, direction, position and size")),
            }
        }
        Ok(edit)
    }
}

impl FromStr for ObjectEdit {
    type Err = EditError;

    fn from_str(text: &str) -> Result<Self, EditError> {
        let mut words = text.split_whitespace();
        let object = index(text, words.next())?;
        let by = three(text, words.next().unwrap_or(""))?;
        match words.next() {
            None => Ok(Self { object, by }),
            Some(word) => Err(EditError::Word { text: text.into(), word: word.into(), reason: "is one word too many" }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun() -> Light {
        let kind = LightKind::Directional { direction: [0.1, -0.9, 1.0 / 3.0], irradiance: 2.5, angle: 0.01 };
        Light { name: "sun".into(), color: [1.0, 0.9, 0.7], kind, is_emissive_proxy: false }
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let mut moved = sun();
        moved.kind = LightKind::Directional { direction: [0.123_456_79, -0.7, 1e-9], irradiance: 0.1, angle: 0.01 };
        let edit = LightEdit::between(0, &sun(), &moved).unwrap();
        assert_eq!(edit.size, None, "what stays is not said");
        let back: LightEdit = edit.to_string().parse().unwrap();
        assert_eq!(back, edit);
        let mut scene = Scene { lights: vec![sun()], ..Scene::default() };
        back.apply(&mut scene).unwrap();
        assert_eq!(scene.lights[0].kind, moved.kind);
        // Negative control: nothing to say between a light and itself.
        assert_eq!(LightEdit::between(0, &moved, &moved), None);
        let object = ObjectEdit { object: 3, by: [0.1, -2.0, 1e-7] };
        assert_eq!(object.to_string().parse(), Ok(object));
    }

    #[test]
    fn lights_are_added_at_the_end() {
        let mut scene = Scene { lights: vec![sun()], ..Scene::default() };
        let edit: LightEdit = "1 kind=point position=1,2,3 strength=4".parse().unwrap();
        edit.apply(&mut scene).unwrap();
        let LightKind::Point { position, intensity, .. } = scene.lights[1].kind else { panic!("{:?}", scene.lights) };
        assert_eq!((position, intensity), ([1.0, 2.0, 3.0], 4.0));
        let again: LightEdit = LightEdit::added(1, &scene.lights[1]).to_string().parse().unwrap();
        let mut other = Scene { lights: vec![sun()], ..Scene::default() };
        again.apply(&mut other).unwrap();
        assert_eq!(other.lights, scene.lights);
        // Not with a gap, nor with what such a light does not have; then nothing has changed.
        assert!("7 kind=sun".parse::<LightEdit>().unwrap().apply(&mut scene).is_err());
        assert!("2 kind=sun position=1,2,3".parse::<LightEdit>().unwrap().apply(&mut scene).is_err());
        assert_eq!(scene.lights.len(), 2);
    }

    #[test]
    fn bad_words_are_named() {
        for (text, word) in [
            ("x strength=1", "x"),
            ("0 strength", "strength"),
            ("0 strength=-1", "strength=-1"),
            ("0 glow=1", "glow=1"),
            ("1 kind=disc", "kind=disc"),
            ("0 position=1,2", "1,2"),
            ("0 direction=0,0,0", "direction=0,0,0"),
            ("0 size=nan", "nan"),
        ] {
            let error = text.parse::<LightEdit>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{word}`")), "{text}: {error}");
        }
        assert!("0 1,2,3 4".parse::<ObjectEdit>().is_err());
        let mut scene = Scene { lights: vec![sun()], ..Scene::default() };
        assert!("1 strength=1".parse::<LightEdit>().unwrap().apply(&mut scene).is_err());
        assert!("0 position=1,2,3".parse::<LightEdit>().unwrap().apply(&mut scene).is_err());
    }
}
