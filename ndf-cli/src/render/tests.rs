use ndf_core::NoProgress;
use ndf_mesh::shapes;

use super::*;

fn picture(mesh: &TriangleMesh, view: View, style: &Style) -> Image {
    let camera = Camera::framing(mesh.positions(), view, 120, 90);
    render(&Scene::new(mesh), &camera, style, &NoProgress)
}

#[test]
fn a_mesh_fills_the_picture_without_touching_its_border() {
    for (yaw, pitch) in [(0.0, 0.0), (30.0, 20.0), (-170.0, 89.0), (90.0, -90.0)] {
        for up in [Up::X, Up::Y, Up::Z] {
            let image = picture(&shapes::cube(2), View { yaw, pitch, up }, &Style::default());
            let seen = |x: usize, y: usize| image.colour[y * image.width + x][3] > 0.0;
            let columns = (0..120).filter(|&x| (0..90).any(|y| seen(x, y))).count();
            let rows = (0..90).filter(|&y| (0..120).any(|x| seen(x, y))).count();
            assert!(columns == 120 - 2 * 5 || rows >= 78, "{columns} columns, {rows} rows");
            assert!(
                (0..120).all(|x| !seen(x, 0) && !seen(x, 89))
                    && (0..90).all(|y| !seen(0, y) && !seen(119, y))
            );
        }
    }
}

#[test]
fn the_camera_stands_where_the_view_says() {
    let mesh = shapes::icosphere(2);
    let eye = |yaw: f64, pitch: f64, up: Up| {
        Camera::framing(mesh.positions(), View { yaw, pitch, up }, 100, 100).eye().normalize()
    };
    assert!(eye(0.0, 0.0, Up::Y).distance(DVec3::Z) < 1e-2);
    assert!(eye(90.0, 0.0, Up::Y).distance(DVec3::X) < 1e-2);
    assert!(eye(0.0, 90.0, Up::Y).distance(DVec3::Y) < 1e-2);
    assert!(eye(0.0, 0.0, Up::Z).distance(DVec3::X) < 1e-2);
}

#[test]
fn depth_and_normals_are_those_of_the_surface() {
    let mesh = shapes::icosphere(4);
    let camera = Camera::framing(mesh.positions(), View::default(), 81, 81);
    let image = render(&Scene::new(&mesh), &camera, &Style::default(), &NoProgress);
    let middle = 40 * 81 + 40;
    let distance = camera.eye().length() - 1.0;
    assert!((f64::from(image.depth[middle]) - distance).abs() < 1e-2);
    let normal = DVec3::from_array(image.normal[middle].map(f64::from));
    assert!(normal.distance(-camera.forward()) < 5e-2);
    assert!(image.scalar[middle].is_nan() && image.depth[0] == f32::INFINITY);
}

#[test]
fn insides_are_red_and_threads_change_nothing() {
    let mesh = shapes::icosphere(3);
    let (positions, faces) = mesh.clone().into_parts();
    let inside_out =
        TriangleMesh::new(positions, faces.into_iter().map(|[a, b, c]| [a, c, b]).collect()).unwrap();
    let redness = |mesh: &TriangleMesh| {
        let image = picture(mesh, View::default(), &Style::default());
        image.colour.iter().map(|[r, _, b, _]| r - b).sum::<f32>()
            / image.colour.iter().map(|p| p[3]).sum::<f32>()
    };
    assert!(redness(&mesh) < 0.1 && redness(&inside_out) > 0.1);

    let style = Style { wireframe: true, ..Style::default() };
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let one = alone.install(|| picture(&mesh, View::default(), &style));
    assert_eq!(
        png_bytes(&one, true).unwrap(),
        png_bytes(&picture(&mesh, View::default(), &style), true).unwrap()
    );
}

#[test]
fn scalars_paint_and_isolines_are_counted() {
    let mesh = shapes::grid(40, 40);
    let values: Vec<f32> = mesh.positions().iter().map(|p| p.x as f32).collect();
    let camera = Camera::framing(mesh.positions(), View { yaw: 0.0, pitch: 0.0, up: Up::Y }, 300, 300);
    let scene = Scene::new(&mesh).painted(&values, ColourMap::of(&values));
    let image = render(&scene, &camera, &Style { isolines: 7, ..Style::default() }, &NoProgress);
    let plain = render(&scene, &camera, &Style::default(), &NoProgress);
    let brightness = |image: &Image, x: usize| image.colour[150 * 300 + x][..3].iter().sum::<f32>();
    let is_line = |x: usize| brightness(&image, x) < 0.6 * brightness(&plain, x);
    assert_eq!((1..300).filter(|&x| is_line(x) && !is_line(x - 1)).count(), 7);
    assert!((image.scalar[150 * 300 + 150] - 0.5).abs() < 1e-2);
}

#[test]
fn broken_meshes_are_survived() {
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let positions = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), DVec3::NAN, corner(2.0, 2.0)];
    let faces = vec![[0, 1, 2], [0, 1, 3], [1, 1, 2], [0, 4, 4]];
    let mesh = TriangleMesh::new(positions, faces).unwrap();
    let values = [0.0, f32::NAN, f32::INFINITY, -1.0, 1.0];
    let camera = Camera::framing(mesh.positions(), View::default(), 40, 30);
    let style = Style { isolines: 3, wireframe: true, flat: false, ..Style::default() };
    let image =
        render(&Scene::new(&mesh).painted(&values, ColourMap::of(&values)), &camera, &style, &NoProgress);
    assert!(image.colour.iter().flatten().all(|c| c.is_finite()));
    assert!(png_bytes(&image, false).is_ok() && exr_bytes(&image, Some("a")).is_ok());
    let point = TriangleMesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]).unwrap();
    let image = picture(&point, View::default(), &Style::default());
    assert!(image.colour.iter().all(|p| *p == [0.0; 4]));
}

#[test]
fn exr_holds_all_channels_as_floats() {
    let mesh = shapes::icosphere(2);
    let values: Vec<f32> = mesh.positions().iter().map(|p| p.z as f32).collect();
    let camera = Camera::framing(mesh.positions(), View::default(), 32, 24);
    let image = render(
        &Scene::new(&mesh).painted(&values, ColourMap::of(&values)),
        &camera,
        &Style::default(),
        &NoProgress,
    );
    let bytes = exr_bytes(&image, Some("height")).unwrap();
    let read = exr::prelude::read_all_flat_layers_from_file;
    let path = std::env::temp_dir().join(format!("ndf-exr-{}.exr", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    let back = read(&path).unwrap();
    std::fs::remove_file(path).unwrap();
    let names: Vec<String> =
        back.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z", "scalar.V"]);
    let depth = &back.layer_data[0].channel_data.list[4].sample_data;
    assert_eq!(depth.values_as_f32().collect::<Vec<_>>(), image.depth);
}
