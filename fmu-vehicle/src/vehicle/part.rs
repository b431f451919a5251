//! Parts of a vehicle: written in place, or in a file of their own.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::marker::PhantomData;
use std::path::PathBuf;
use terramech_fmi2::UnitError;
use terramech_fmi2::specification::{Faults, parse};

/// A part given in place (a JSON object) or by the name of a JSON file (a string).
#[derive(Clone, Debug, PartialEq)]
pub enum Part<T> {
    /// File name, relative to the file that names it; the library's own data are found under their names too (`hmmwv/vehicle.json`).
    File(String),
    /// The part itself.
    Inline(Box<T>),
}

impl<T> Part<T> {
    /// The part, once files are resolved.
    ///
    /// # Panics
    /// If it is still a file name; [`Part::resolve`] comes first.
    pub fn get(&self) -> &T {
        match self {
            Self::Inline(t) => t,
            Self::File(name) => panic!("part '{name}' was not resolved"),
        }
    }
}

impl<T: Serialize> Serialize for Part<T> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::File(name) => name.serialize(s),
            Self::Inline(t) => t.serialize(s),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Part<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        // By hand instead of `untagged`, which would swallow the path and the reason of a fault inside the part.
        struct Either<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = Part<T>;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("an object, or the name of a JSON file")
            }
            fn visit_str<E>(self, s: &str) -> Result<Part<T>, E> {
                Ok(Part::File(s.into()))
            }
            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Part<T>, M::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(|t| Part::Inline(Box::new(t)))
            }
        }
        d.deserialize_any(Either(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Part<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Part_{}", T::schema_name()).into()
    }
    fn json_schema(g: &mut SchemaGenerator) -> Schema {
        let inline = g.subschema_for::<T>();
        schemars::json_schema!({"anyOf": [{"type": "string", "description": "JSON file with the part"}, inline]})
    }
}

/// Data that come with the library, by name.
const SHIPPED: &[(&str, &str)] = &[
    ("hmmwv/vehicle.json", include_str!("../../data/hmmwv/vehicle.json")),
    ("hmmwv/vehicle_2550.json", include_str!("../../data/hmmwv/vehicle_2550.json")),
    ("hmmwv/three_axles.json", include_str!("../../data/hmmwv/three_axles.json")),
    ("hmmwv/four_axles.json", include_str!("../../data/hmmwv/four_axles.json")),
    ("hmmwv/vehicle_2018.json", include_str!("../../data/hmmwv/vehicle_2018.json")),
    ("hmmwv/suspension_front.json", include_str!("../../data/hmmwv/suspension_front.json")),
    ("hmmwv/suspension_rear.json", include_str!("../../data/hmmwv/suspension_rear.json")),
    ("hmmwv/suspension_front_2018.json", include_str!("../../data/hmmwv/suspension_front_2018.json")),
    ("hmmwv/suspension_rear_2018.json", include_str!("../../data/hmmwv/suspension_rear_2018.json")),
    ("hmmwv/steering.json", include_str!("../../data/hmmwv/steering.json")),
    ("hmmwv/driveline.json", include_str!("../../data/hmmwv/driveline.json")),
    ("hmmwv/powertrain.json", include_str!("../../data/hmmwv/powertrain.json")),
    ("hmmwv/powertrain_2018.json", include_str!("../../data/hmmwv/powertrain_2018.json")),
    ("hmmwv/driveline_rear.json", include_str!("../../data/hmmwv/driveline_rear.json")),
    ("hmmwv/driveline_simple.json", include_str!("../../data/hmmwv/driveline_simple.json")),
    ("hmmwv/powertrain_map.json", include_str!("../../data/hmmwv/powertrain_map.json")),
];

/// Where names of files are looked up.
#[derive(Clone, Debug)]
pub enum Place {
    /// A folder on disk; `None`: nowhere but the library's data.
    Folder(Option<PathBuf>),
    /// A folder of the library's data.
    Shipped(String),
}

impl Place {
    /// Text of a file that is not JSON.
    ///
    /// # Errors
    /// [`UnitError::Input`]: not there.
    pub fn text(&self, name: &str) -> Result<String, UnitError> {
        self.read(name).map(|r| r.0)
    }
    /// Text of a file, its name for messages, and the place that names inside it refer to.
    fn read(&self, name: &str) -> Result<(String, String, Place), UnitError> {
        let shipped = |full: &str| {
            SHIPPED.iter().find(|(n, _)| *n == full).map(|(n, text)| {
                let folder = n.rsplit_once('/').map_or("", |p| p.0);
                (text.to_string(), format!("{n} (shipped)"), Place::Shipped(folder.into()))
            })
        };
        let in_folder = match self {
            Place::Folder(Some(folder)) => {
                let path = folder.join(name);
                if path.is_file() {
                    let text = std::fs::read_to_string(&path)
                        .map_err(|e| UnitError::input(format!("{}: cannot be read: {e}", path.display())))?;
                    return Ok((text, path.display().to_string(), Place::Folder(path.parent().map(Into::into))));
                }
                None
            }
            Place::Folder(None) => None,
            Place::Shipped(folder) => shipped(&format!("{folder}/{name}")),
        };
        in_folder.or_else(|| shipped(name)).ok_or_else(|| {
            let names: Vec<&str> = SHIPPED.iter().map(|s| s.0).collect();
            let folder = match self {
                Place::Folder(Some(f)) => format!("{}", f.display()),
                Place::Folder(None) => "(no folder)".into(),
                Place::Shipped(f) => f.clone(),
            };
            UnitError::input(format!(
                "file '{name}' is neither in {folder} nor shipped; shipped are: {}",
                names.join(", ")
            ))
        })
    }
}

impl<T: DeserializeOwned> Part<T> {
    /// Replaces a file name by the file's content; `nested` then resolves names inside it. `path` is the JSON path so far; faults are collected.
    pub fn resolve(
        &mut self,
        place: &Place,
        path: &str,
        faults: &mut Faults,
        mut nested: impl FnMut(&mut T, &Place, &str, &mut Faults),
    ) {
        match self {
            Self::Inline(t) => nested(t, place, path, faults),
            Self::File(name) => {
                let read = place.read(name).and_then(|(text, origin, inner)| {
                    parse::<T>(&text, &format!("'{path}', file {origin}")).map(|value| (value, inner))
                });
                match read {
                    Ok((mut value, inner)) => {
                        nested(&mut value, &inner, &format!("{path} in {name}"), faults);
                        *self = Self::Inline(Box::new(value));
                    }
                    Err(e) => faults.add(e.to_string()),
                }
            }
        }
    }
}
