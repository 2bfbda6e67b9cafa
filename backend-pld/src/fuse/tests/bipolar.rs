//! The bipolar PALs: fixed properties, and files that name one of several devices.

use crate::device::Device;
use crate::fuse::{FuseMap, codes, decode, map};
use crate::jedec::{Head, read, write};
use crate::placement::{Cell, CellKind, Placement, Product};
use grafsynth_ir::span::FileId;

fn with(device: &str, pin: u32, kind: CellKind, is_active_low: bool) -> Placement {
    let mut placement = Placement::new(Device::find(device).unwrap());
    let sum = vec![Product(vec![(2, true), (3, false)]), Product(vec![(4, true)])];
    placement.cells.push(Cell::new(pin, kind, is_active_low, sum));
    placement
}

#[test]
fn what_the_maker_fixed_is_refused_by_name() {
    let refused = [
        (
            "pal16l8",
            15,
            CellKind::Registered,
            true,
            "pin 15 of a pal16l8 cannot be a registered output",
        ),
        (
            "pal16r4",
            15,
            CellKind::Combinational,
            true,
            "pin 15 of a pal16r4 cannot be a combinational output",
        ),
        ("pal16r4", 13, CellKind::Combinational, false, "pin 13 of a pal16r4 is always active low"),
        ("pal16h2", 15, CellKind::Combinational, true, "pin 15 of a pal16h2 is always active high"),
        ("pal12h6", 12, CellKind::Combinational, false, "pin 12 of a pal12h6 has no macrocell"),
    ];
    for (device, pin, kind, is_active_low, wanted) in refused {
        let found = map(&with(device, pin, kind, is_active_low)).unwrap_err();
        assert_eq!(found.iter().map(|one| one.message.as_str()).collect::<Vec<_>>(), [wanted]);
    }
    let taken = [
        ("pal16l8", 15, CellKind::Combinational, true, 2048, 32 * 32 + 32),
        ("pal16r4", 15, CellKind::Registered, true, 2048, 32 * 32),
        ("pal12h6", 18, CellKind::Combinational, false, 384, 0),
        ("pal10l8", 18, CellKind::Combinational, true, 320, 2 * 20),
        ("pal16l2", 15, CellKind::Combinational, true, 512, 8 * 32),
    ];
    for (device, pin, kind, is_active_low, n_fuses, first) in taken {
        let fuses = map(&with(device, pin, kind, is_active_low)).unwrap();
        assert_eq!(fuses.fuses.len(), n_fuses, "{device}");
        // Pin 2 is on column 0 and its complement on 1; pin 3 on 4 and 5.
        let row: Vec<bool> = fuses.fuses[first..first + 6].to_vec();
        assert_eq!(row, [false, true, true, true, true, false], "{device}");
        assert_eq!(decode(&fuses).unwrap().cell(pin).unwrap().sum.len(), 2);
    }
}

#[test]
fn a_file_says_which_of_several_devices_it_is_for() {
    let fuses = map(&with("pal16r6", 16, CellKind::Registered, true)).unwrap();
    let device_of = |line: &str| {
        let text = write(&fuses, &Head { lines: vec![line.to_owned()], pins: Vec::new() }, &[]);
        let (file, found) = read(FileId(0), &text);
        assert_eq!(found, []);
        file.unwrap().fuse_map(None).map(|map: FuseMap| map.device.name)
    };
    for line in
        ["Device: PAL16R6", "Device    AmPAL16R6A", "TIBPAL16R6-15CN", "Device p16r6  DLIB-h-36-9"]
    {
        assert_eq!(device_of(line).unwrap(), "pal16r6", "{line}");
    }
    for (line, which) in
        [("", "none"), ("PAL16R61", "none"), ("16R6", "none"), ("PAL16R4 or PAL16R6", "several")]
    {
        let found = device_of(line).unwrap_err();
        assert_eq!(found.code, codes::SEVERAL_DEVICES);
        assert!(found.message.contains(which), "{line}: {}", found.message);
    }
    // A fuse count that only one device has needs no name.
    let fuses = map(&with("gal16v8", 16, CellKind::Registered, true)).unwrap();
    let text = write(&fuses, &Head::default(), &[]);
    assert_eq!(read(FileId(0), &text).0.unwrap().fuse_map(None).unwrap().device.name, "gal16v8");
}
