//! OpenGL 3.3 without a window: Mesa's llvmpipe, a rasterizer with a just-in-time compiler, on one thread.
//!
//! EGL is loaded when the program runs, so that it builds and runs where there is none.
#![expect(unsafe_code, reason = "OpenGL and EGL are C")]
// SAFETY, for every block below: the context is made current by `new`, on the thread that owns `OpenGl`, and
// stays so until it is dropped (raw pointers inside keep it from being sent to another). Every slice is
// longer than what OpenGL is told to read or write, and every offset into a buffer comes from the data
// uploaded to it.

use glow::{
    ARRAY_BUFFER, BACK, BLEND, COLOR_ATTACHMENT0, COLOR_BUFFER_BIT, CULL_FACE, DEPTH_ATTACHMENT,
    DEPTH_BUFFER_BIT, DEPTH_COMPONENT, DEPTH_COMPONENT32F, DEPTH_TEST, ELEMENT_ARRAY_BUFFER, FLOAT,
    FRAGMENT_SHADER, FRAMEBUFFER, FRAMEBUFFER_COMPLETE, HasContext, LESS, LINEAR, LINEAR_MIPMAP_NEAREST, ONE,
    ONE_MINUS_SRC_ALPHA, PixelPackData, PixelUnpackData, RENDERBUFFER, RENDERER, RGBA, RGBA8, STATIC_DRAW,
    TEXTURE_2D, TEXTURE_MAG_FILTER, TEXTURE_MIN_FILTER, TRIANGLES, UNSIGNED_BYTE, UNSIGNED_INT, VERSION,
    VERTEX_SHADER,
};
use khronos_egl as egl;

use crate::contestant::Contestant;
use crate::frame::PIXELS;
use crate::workloads::{CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, LIGHT, Shading, Texture, WIDTH, Workload};

const VERTEX: &str = "
uniform mat4 transform;
layout(location = 0) in vec3 position;
#ifdef LIT
layout(location = 1) in vec3 normal_in;
out vec3 normal;
#endif
#ifdef UV
layout(location = 2) in vec2 uv_in;
out vec2 uv;
#endif
#ifdef BLEND
layout(location = 1) in vec4 color_in;
out vec4 color;
#endif
void main() {
#ifdef LIT
    normal = normal_in;
#endif
#ifdef UV
    uv = uv_in;
#endif
#ifdef BLEND
    color = color_in;
#endif
    gl_Position = transform * vec4(position, 1.0);
}";

/// The scalar functions of `workloads`, once more.
const FRAGMENT: &str = "
#ifdef LIT
in vec3 normal;
uniform vec3 light;
float lambert() {
    return 0.25 + 0.75 * clamp(dot(normal, light) / sqrt(dot(normal, normal)), 0.0, 1.0);
}
#endif
#ifdef UV
in vec2 uv;
bool is_light() {
    ivec2 cell = ivec2(floor(uv * 8.0));
    return ((cell.x ^ cell.y) & 1) == 0;
}
#endif
#ifdef BLEND
in vec4 color;
#endif
#ifdef TEXTURE
uniform sampler2D waves;
#endif
#ifndef DEPTH_ONLY
out vec4 pixel;
#endif
void main() {
#if defined(TEXTURE)
    pixel = vec4(texture(waves, uv).rgb * lambert(), 1.0);
#elif defined(LIT)
    pixel = vec4((is_light() ? vec3(0.94, 0.86, 0.72) : vec3(0.16, 0.29, 0.48)) * lambert(), 1.0);
#elif defined(UV)
    pixel = is_light() ? vec4(240, 220, 184, 255) / 255.0 : vec4(40, 74, 122, 255) / 255.0;
#elif defined(BLEND)
    pixel = color;
#endif
}";

pub struct OpenGl {
    name: String,
    gl: glow::Context,
    egl: egl::DynamicInstance<egl::EGL1_5>,
    display: egl::Display,
    context: egl::Context,
    scene: Option<Scene>,
}

/// What `prepare` uploaded.
struct Scene {
    program: glow::Program,
    array: glow::VertexArray,
    buffers: Vec<glow::Buffer>,
    texture: Option<glow::Texture>,
    index_count: i32,
}

impl OpenGl {
    /// A context with a 1920×1080 framebuffer, or why there is none.
    pub fn new() -> Result<Self, String> {
        // Software, and on this thread alone: the numbers are for one core.
        // SAFETY: nothing has started a thread yet.
        unsafe {
            std::env::set_var("LIBGL_ALWAYS_SOFTWARE", "1");
            std::env::set_var("LP_NUM_THREADS", "0");
        }
        let egl = unsafe { egl::DynamicInstance::<egl::EGL1_5>::load_required() }
            .map_err(|error| format!("libEGL.so.1 with EGL 1.5: {error}"))?;
        let because = |what: &'static str| move |error: egl::Error| format!("{what}: {error}");

        const SURFACELESS_MESA: egl::Enum = 0x31DD;
        let display =
            unsafe { egl.get_platform_display(SURFACELESS_MESA, egl::DEFAULT_DISPLAY, &[egl::ATTRIB_NONE]) }
                .map_err(because("no display without a surface"))?;
        egl.initialize(display).map_err(because("eglInitialize"))?;
        egl.bind_api(egl::OPENGL_API).map_err(because("no desktop OpenGL"))?;
        let config = [egl::SURFACE_TYPE, egl::PBUFFER_BIT, egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::NONE];
        let config = egl
            .choose_first_config(display, &config)
            .map_err(because("eglChooseConfig"))?
            .ok_or("no configuration for OpenGL")?;
        let version = [
            egl::CONTEXT_MAJOR_VERSION,
            3,
            egl::CONTEXT_MINOR_VERSION,
            3,
            egl::CONTEXT_OPENGL_PROFILE_MASK,
            egl::CONTEXT_OPENGL_CORE_PROFILE_BIT,
            egl::NONE,
        ];
        let context =
            egl.create_context(display, config, None, &version).map_err(because("no OpenGL 3.3"))?;
        egl.make_current(display, None, None, Some(context)).map_err(because("eglMakeCurrent"))?;

        let address = |name: &str| egl.get_proc_address(name).map_or(core::ptr::null(), |f| f as *const _);
        let gl = unsafe { glow::Context::from_loader_function(address) };
        let (renderer, version) = unsafe {
            create_framebuffer(&gl)?;
            (gl.get_parameter_string(RENDERER), gl.get_parameter_string(VERSION))
        };
        eprintln!("OpenGL: {renderer}, {version}");
        let name = renderer.split(' ').next().unwrap_or("OpenGL").to_owned();
        Ok(Self { name, gl, egl, display, context, scene: None })
    }

    /// Uploads `values` and returns their buffer, bound to `target`.
    unsafe fn upload(&self, target: u32, bytes: &[u8]) -> glow::Buffer {
        unsafe {
            let buffer = self.gl.create_buffer().expect("OpenGL gives a buffer");
            self.gl.bind_buffer(target, Some(buffer));
            self.gl.buffer_data_u8_slice(target, bytes, STATIC_DRAW);
            buffer
        }
    }

    /// Points an attribute of `size` floats into the bound buffer, `offset` bytes from its start.
    unsafe fn attribute(&self, location: u32, size: i32, stride: i32, offset: i32) {
        unsafe {
            self.gl.enable_vertex_attrib_array(location);
            self.gl.vertex_attrib_pointer_f32(location, size, FLOAT, false, stride, offset);
        }
    }

    unsafe fn program(&self, defines: &str) -> glow::Program {
        unsafe {
            let program = self.gl.create_program().expect("OpenGL gives a program");
            for (stage, source) in [(VERTEX_SHADER, VERTEX), (FRAGMENT_SHADER, FRAGMENT)] {
                let shader = self.gl.create_shader(stage).expect("OpenGL gives a shader");
                self.gl.shader_source(shader, &format!("#version 330 core\n{defines}{source}"));
                self.gl.compile_shader(shader);
                let log = self.gl.get_shader_info_log(shader);
                assert!(self.gl.get_shader_compile_status(shader), "shader: {log}");
                self.gl.attach_shader(program, shader);
                self.gl.delete_shader(shader);
            }
            self.gl.link_program(program);
            let log = self.gl.get_program_info_log(program);
            assert!(self.gl.get_program_link_status(program), "program: {log}");
            program
        }
    }

    unsafe fn texture(&self, texture: &Texture) -> glow::Texture {
        unsafe {
            let handle = self.gl.create_texture().expect("OpenGL gives a texture");
            self.gl.bind_texture(TEXTURE_2D, Some(handle));
            for (level, (side, texels)) in (0..).zip(texture.levels()) {
                let bytes: Vec<u8> = texels.iter().flat_map(|texel| texel.to_le_bytes()).collect();
                let side = side as i32;
                let data = PixelUnpackData::Slice(Some(&bytes));
                let format = (RGBA8 as i32, RGBA, UNSIGNED_BYTE);
                self.gl.tex_image_2d(TEXTURE_2D, level, format.0, side, side, 0, format.1, format.2, data);
            }
            self.gl.tex_parameter_i32(TEXTURE_2D, TEXTURE_MIN_FILTER, LINEAR_MIPMAP_NEAREST as i32);
            self.gl.tex_parameter_i32(TEXTURE_2D, TEXTURE_MAG_FILTER, LINEAR as i32);
            handle
        }
    }

    fn drop_scene(&mut self) {
        let Some(scene) = self.scene.take() else { return };
        unsafe {
            self.gl.delete_program(scene.program);
            self.gl.delete_vertex_array(scene.array);
            scene.buffers.into_iter().for_each(|buffer| self.gl.delete_buffer(buffer));
            scene.texture.into_iter().for_each(|texture| self.gl.delete_texture(texture));
        }
    }

    fn read(&self, format: u32, kind: u32) -> Vec<[u8; 4]> {
        let mut bytes = vec![0; 4 * PIXELS];
        let data = PixelPackData::Slice(Some(&mut bytes));
        unsafe { self.gl.read_pixels(0, 0, WIDTH as i32, HEIGHT as i32, format, kind, data) };
        // OpenGL's first row is the lowest.
        let rows = bytes.as_chunks::<4>().0.chunks_exact(WIDTH as usize);
        rows.rev().flatten().copied().collect()
    }
}

impl Contestant for OpenGl {
    fn name(&self) -> &str {
        &self.name
    }

    fn supports(&self, _: &Workload) -> bool {
        true
    }

    fn prepare(&mut self, workload: &Workload) {
        self.drop_scene();
        let gl = &self.gl;
        unsafe {
            let array = gl.create_vertex_array().expect("OpenGL gives a vertex array");
            gl.bind_vertex_array(Some(array));
            let mut buffers = Vec::new();
            buffers.push(
                self.upload(ARRAY_BUFFER, &bytes(workload.positions.iter().flat_map(|p| p.to_array()))),
            );
            self.attribute(0, 3, 12, 0);
            let lit_bytes = |varyings: &[crate::workloads::Lit]| {
                bytes(
                    varyings
                        .iter()
                        .flat_map(|lit| lit.normal.to_array().into_iter().chain(lit.uv.to_array())),
                )
            };
            let (defines, varyings) = match &workload.shading {
                Shading::DepthOnly => ("#define DEPTH_ONLY\n", Vec::new()),
                Shading::Checker(uvs) => ("#define UV\n", bytes(uvs.iter().flat_map(|uv| uv.to_array()))),
                Shading::LitChecker(varyings) => ("#define LIT\n#define UV\n", lit_bytes(varyings)),
                Shading::LitTexture(varyings, _) => {
                    ("#define LIT\n#define UV\n#define TEXTURE\n", lit_bytes(varyings))
                }
                Shading::Blend(colors) => {
                    ("#define BLEND\n", bytes(colors.iter().flat_map(|c| c.to_array())))
                }
            };
            buffers.push(self.upload(ARRAY_BUFFER, &varyings));
            match &workload.shading {
                Shading::DepthOnly => {}
                Shading::Checker(_) => self.attribute(2, 2, 8, 0),
                Shading::LitChecker(_) | Shading::LitTexture(..) => {
                    self.attribute(1, 3, 20, 0);
                    self.attribute(2, 2, 20, 12);
                }
                Shading::Blend(_) => self.attribute(1, 4, 16, 0),
            }
            let indices: Vec<u8> = workload.indices.iter().flat_map(|index| index.to_ne_bytes()).collect();
            buffers.push(self.upload(ELEMENT_ARRAY_BUFFER, &indices));

            let program = self.program(defines);
            gl.use_program(Some(program));
            // OpenGL's depth is in [−1, 1] before the viewport: z' = 2z − w.
            let mut to_gl = glam::Mat4::IDENTITY;
            (to_gl.z_axis.z, to_gl.w_axis.z) = (2.0, -1.0);
            let transform = (to_gl * workload.transform).to_cols_array();
            let location = |name: &str| gl.get_uniform_location(program, name);
            gl.uniform_matrix_4_f32_slice(location("transform").as_ref(), false, &transform);
            gl.uniform_3_f32_slice(location("light").as_ref(), &LIGHT.to_array());
            let texture = match &workload.shading {
                Shading::LitTexture(_, texture) => Some(self.texture(texture)),
                _ => None,
            };

            let switch = |state: u32, on: bool| if on { gl.enable(state) } else { gl.disable(state) };
            switch(CULL_FACE, workload.cull_back);
            switch(BLEND, matches!(workload.shading, Shading::Blend(_)));
            let index_count = workload.indices.len() as i32;
            self.scene = Some(Scene { program, array, buffers, texture, index_count });
        }
    }

    fn clear(&mut self) {
        let [red, green, blue, alpha] = CLEAR_COLOR.to_le_bytes().map(|byte| f32::from(byte) / 255.0);
        unsafe {
            self.gl.color_mask(true, true, true, true);
            self.gl.clear_color(red, green, blue, alpha);
            self.gl.clear_depth_f32(CLEAR_DEPTH);
            self.gl.clear(COLOR_BUFFER_BIT | DEPTH_BUFFER_BIT);
            self.gl.finish();
        }
    }

    fn draw(&mut self, workload: &Workload) {
        let Some(scene) = &self.scene else { return };
        let color = !matches!(workload.shading, Shading::DepthOnly);
        unsafe {
            self.gl.color_mask(color, color, color, color);
            self.gl.draw_elements(TRIANGLES, scene.index_count, UNSIGNED_INT, 0);
            self.gl.finish();
        }
    }

    fn read_pixels(&mut self) -> Vec<u32> {
        self.read(RGBA, UNSIGNED_BYTE).into_iter().map(u32::from_le_bytes).collect()
    }

    fn read_depth(&mut self) -> Vec<f32> {
        self.read(DEPTH_COMPONENT, FLOAT).into_iter().map(f32::from_ne_bytes).collect()
    }
}

impl Drop for OpenGl {
    fn drop(&mut self) {
        self.drop_scene();
        // An error here leaves nothing to be done: the process ends.
        let _ = self.egl.make_current(self.display, None, None, None);
        let _ = self.egl.destroy_context(self.display, self.context);
        let _ = self.egl.terminate(self.display);
    }
}

/// RGBA8 and 32-bit float depth, as the other contestants have, and the state that all workloads share.
unsafe fn create_framebuffer(gl: &glow::Context) -> Result<(), String> {
    unsafe {
        let framebuffer = gl.create_framebuffer()?;
        gl.bind_framebuffer(FRAMEBUFFER, Some(framebuffer));
        for (format, attachment) in [(RGBA8, COLOR_ATTACHMENT0), (DEPTH_COMPONENT32F, DEPTH_ATTACHMENT)] {
            let renderbuffer = gl.create_renderbuffer()?;
            gl.bind_renderbuffer(RENDERBUFFER, Some(renderbuffer));
            gl.renderbuffer_storage(RENDERBUFFER, format, WIDTH as i32, HEIGHT as i32);
            gl.framebuffer_renderbuffer(FRAMEBUFFER, attachment, RENDERBUFFER, Some(renderbuffer));
        }
        if gl.check_framebuffer_status(FRAMEBUFFER) != FRAMEBUFFER_COMPLETE {
            return Err("no framebuffer of RGBA8 and 32-bit depth".to_owned());
        }
        gl.viewport(0, 0, WIDTH as i32, HEIGHT as i32);
        gl.enable(DEPTH_TEST);
        gl.depth_func(LESS);
        gl.cull_face(BACK);
        gl.blend_func(ONE, ONE_MINUS_SRC_ALPHA);
        Ok(())
    }
}

fn bytes(values: impl Iterator<Item = f32>) -> Vec<u8> {
    values.flat_map(f32::to_ne_bytes).collect()
}
