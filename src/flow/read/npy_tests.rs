use super::npy::{Array, Frame, array, centred, staggered};
use super::{Kind, Quantity};

/// A file as the format's description has it.
fn file(version: u8, descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    let before = if version == 1 { 10 } else { 12 };
    while (before + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut file = b"\x93NUMPY".to_vec();
    file.extend([version, 0]);
    match version {
        1 => file.extend((header.len() as u16).to_le_bytes()),
        _ => file.extend((header.len() as u32).to_le_bytes()),
    }
    file.extend(header.as_bytes());
    file.extend(data);
    file
}

fn frame(axes: usize) -> Frame<'static> {
    let high = [4.0, if axes > 1 { 3.0 } else { 1.0 }, if axes > 2 { 2.0 } else { 1.0 }];
    Frame { low: [0.0; 3], high, axes, factor: 1.0, quantity: Quantity::Discharge, porosity: &|_, _| 0.25 }
}

#[test]
fn bytes_and_orders_come_to_the_same_numbers() {
    let numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.5];
    let fortran = [0.0, 3.0, 1.0, 4.0, 2.0, 5.5];
    let expected = Array { shape: vec![2, 3], values: numbers.to_vec() };
    let data =
        |values: &[f64], to: &dyn Fn(f64) -> Vec<u8>| values.iter().flat_map(|&x| to(x)).collect::<Vec<_>>();
    for version in 1..=3 {
        let doubles = data(&numbers, &|x| x.to_le_bytes().to_vec());
        assert_eq!(array(&file(version, "<f8", false, "(2, 3)", &doubles)).unwrap(), expected);
        let swapped = data(&fortran, &|x| x.to_be_bytes().to_vec());
        assert_eq!(array(&file(version, ">f8", true, "(2, 3)", &swapped)).unwrap(), expected);
        let singles = data(&numbers, &|x| (x as f32).to_le_bytes().to_vec());
        assert_eq!(array(&file(version, "<f4", false, "(2, 3)", &singles)).unwrap(), expected);
        let swapped = data(&fortran, &|x| (x as f32).to_be_bytes().to_vec());
        assert_eq!(array(&file(version, ">f4", true, "(2, 3)", &swapped)).unwrap(), expected);
    }
}

#[test]
fn wrong_files_are_named() {
    let kind = |bytes: &[u8]| array(bytes).unwrap_err().kind;
    assert_eq!(kind(b""), Kind::Foreign);
    assert_eq!(kind(b"PK\x03\x04 an npz"), Kind::Foreign);
    assert_eq!(kind(&file(4, "<f8", false, "(1,)", &[0; 8])), Kind::Unsupported);
    assert_eq!(kind(&file(1, "<f8", false, "(2,)", &[0; 8])), Kind::Damaged);
    assert_eq!(kind(&file(1, "<f8", false, "(1,)", &[0; 9])), Kind::Damaged);
    let huge = "(4294967296, 4294967296, 16)";
    assert_eq!(kind(&file(1, "<f8", false, huge, &[0; 8])), Kind::Damaged);
    assert_eq!(kind(&file(1, "<f8", false, "(2305843009213693952,)", &[0; 8])), Kind::Damaged);
    let nan = file(1, "<f8", false, "(1,)", &f64::NAN.to_le_bytes());
    assert_eq!(
        array(&nan).unwrap_err().to_string(),
        "byte 128: element 0 in the order of the file is NaN; \
        a flow has a value everywhere: write 0 where there is none"
    );
}

#[test]
fn the_middles_of_cells_become_faces() {
    let values = (0..24).map(|idx| if idx % 2 == 0 { 2.0 } else { -1.0 }).collect();
    let flow = centred(&Array { shape: vec![4, 3, 2], values }, &Frame { factor: 0.5, ..frame(2) }).unwrap();
    assert!(flow.flux[0].iter().all(|&q| q == 1.0) && flow.flux[1].iter().all(|&q| q == -0.5));
    assert_eq!((flow.flux[0].len(), flow.flux[1].len(), flow.flux[2].len()), (15, 16, 24));
    assert!(flow.flux[2].iter().all(|&q| q == 0.0));
    assert_eq!((flow.balance().worst, flow.through_flow()), (0.0, 3.0 + 2.0));
    let plain = centred(&Array { shape: vec![5], values: vec![1.0; 5] }, &frame(1)).unwrap();
    assert_eq!(plain.flux[0], [1.0; 6]);
    let wrong = centred(&Array { shape: vec![4, 3], values: vec![1.0; 12] }, &frame(2)).unwrap_err();
    assert_eq!(wrong.kind, Kind::Mismatch);
}

#[test]
fn faces_are_taken_as_they_are() {
    let x = Array { shape: vec![3, 2], values: vec![1.0, 2.0, 1.0, 2.0, 1.0, 2.5] };
    let y = Array { shape: vec![2, 3], values: vec![0.0; 6] };
    let flow = staggered(&[x.clone(), y.clone()], &frame(2)).unwrap();
    assert_eq!(flow.flux[0], x.values);
    // Cells of 2 m by 1.5 m: the upper right one loses 0.5 m/s through 1.5 m.
    let balance = flow.balance();
    assert_eq!((balance.worst_cell, balance.worst), (3, 0.75));
    let wrong = staggered(&[x, Array { shape: vec![3, 2], ..y }], &frame(2)).unwrap_err();
    assert_eq!(wrong.kind, Kind::Mismatch);
    assert!(wrong.message.contains("normal to y have the shape [3, 2]"), "{wrong}");
    let empty = Array { shape: vec![0, 2], values: Vec::new() };
    assert!(staggered(&[empty.clone(), empty], &frame(2)).is_err());
}
