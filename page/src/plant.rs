//! The plant of a page as JSON, which `web/plant.js` runs and `web/scene.js` draws.

use grafsynth_ir::plant::{Condition, Place, Plant, Reading, Sensor};
use serde_json::{Value, json};

/// A plant: numbers refer to quantities, inputs and outputs in the order of the data.
pub(crate) fn plant_json(plant: &Plant) -> Value {
    json!({
        "view": [plant.view.0, plant.view.1],
        "quantities": plant.quantities.values().map(|it| json!({
            "name": it.name,
            "label": it.label,
            "lo": it.lo,
            "hi": it.hi,
            "init": it.init,
        })).collect::<Vec<_>>(),
        "moves": plant.moves.iter().map(|it| {
            let speed = it.speed.map(grafsynth_ir::Id::index);
            json!([it.quantity.index(), it.rate, speed, condition(&it.when)])
        }).collect::<Vec<_>>(),
        "sets": plant.sets.iter().map(|it| {
            json!([it.quantity.index(), it.value, condition(&it.when)])
        }).collect::<Vec<_>>(),
        "sensors": plant.sensors.iter().map(|(input, sensor)| match sensor {
            Sensor::Is(when) => json!([input.index(), null, condition(when)]),
            Sensor::Measures(quantity) => json!([input.index(), quantity.index(), null]),
        }).collect::<Vec<_>>(),
        "shapes": plant.shapes.iter().map(|it| {
            let places: Vec<Value> = it.places.iter().map(place).collect();
            let fill = it.fill.map(grafsynth_ir::plant::Colour::word);
            json!([it.kind.word(), places, it.text, fill, condition(&it.when)])
        }).collect::<Vec<_>>(),
    })
}

/// A sign and operands, or a reading (0: a quantity, 1: an input, 2: an output) with its bounds.
fn condition(it: &Condition) -> Value {
    let joined = |sign: &str, all: &[Condition]| {
        Value::Array([json!(sign)].into_iter().chain(all.iter().map(condition)).collect())
    };
    match it {
        Condition::All(all) => joined("all", all),
        Condition::Any(any) => joined("any", any),
        Condition::Not(inner) => joined("not", std::slice::from_ref(inner)),
        Condition::Within(reading, lo, hi) => {
            let (kind, id) = match reading {
                Reading::Quantity(id) => (0, id.index()),
                Reading::Input(id) => (1, id.index()),
                Reading::Output(id) => (2, id.index()),
            };
            json!([kind, id, lo, hi])
        }
    }
}

/// The constant part, then each quantity with its factor and its divisor.
fn place(it: &Place) -> Value {
    let terms = it.terms.iter().map(|(id, factor, divisor)| json!([id.index(), factor, divisor]));
    Value::Array([json!(it.base)].into_iter().chain(terms).collect())
}
