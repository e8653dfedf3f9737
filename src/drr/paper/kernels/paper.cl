// The image side of the paper's method (paper_engine.h). Images are float, row by row; a "slot" is one image.

// One ray per work-item: the plain sum of all samples, tri-linear, on the spheres that all rays share. The volume has
// one layer of air around it and positions are clamped into it, so every work-item runs the same instructions.
__kernel void paper_drr(__global const float* restrict volume, const int row, const int slice, const float4 upper,
                        const float4 origin, const float4 corner, const float4 column_step, const float4 row_step,
                        const float4 camera,  // cx, cy, 1/fx, 1/fy
                        const float first_mm, const float step_mm, const int samples, const float scale,
                        const int width, const int height, __global float* restrict images, const int slot) {
  const int u = get_global_id(0);
  const int v = get_global_id(1);
  const float fu = (float)min(u, width - 1);  // Padding work-items repeat the edge and write nothing.
  const float fv = (float)min(v, height - 1);
  const float a = (fu - camera.x) * camera.z;
  const float b = (fv - camera.y) * camera.w;
  const float inverse_length = 1.0f / sqrt(a * a + b * b + 1.0f);
  const float4 direction = (corner + fu * column_step + fv * row_step) * inverse_length;
  float sum = 0.0f;
  for (int s = 0; s < samples; ++s) {
    const float t = first_mm + (float)s * step_mm;
    const float x = clamp(origin.x + t * direction.x, 0.0f, upper.x);
    const float y = clamp(origin.y + t * direction.y, 0.0f, upper.y);
    const float z = clamp(origin.z + t * direction.z, 0.0f, upper.z);
    const int ix = (int)x;
    const int iy = (int)y;
    const int iz = (int)z;
    const float fx = x - (float)ix;
    const float fy = y - (float)iy;
    const float fz = z - (float)iz;
    __global const float* c = volume + (slice * iz + row * iy + ix);
    const float c00 = c[0] + fx * (c[1] - c[0]);
    const float c10 = c[row] + fx * (c[row + 1] - c[row]);
    const float c01 = c[slice] + fx * (c[slice + 1] - c[slice]);
    const float c11 = c[slice + row] + fx * (c[slice + row + 1] - c[slice + row]);
    const float c0 = c00 + fy * (c10 - c00);
    const float c1 = c01 + fy * (c11 - c01);
    sum += c0 + fz * (c1 - c0);
  }
  if (u < width && v < height) images[(slot * height + v) * width + u] = sum * scale;
}

// Separable filter, first pass: rows of weights · image. Third dimension: slot.
__kernel void paper_blur_rows(__global const float* restrict images, __global const float* restrict weights,
                              __global const float* restrict half_taps, const int radius, const int width,
                              const int height, __global float* restrict rows) {
  const int u = get_global_id(0);
  const int v = get_global_id(1);
  if (u >= width || v >= height) return;
  __global const float* line = images + (get_global_id(2) * height + v) * width;
  __global const float* line_weights = weights + v * width;
  float sum = 0.0f;
  for (int x = max(u - radius, 0); x <= min(u + radius, width - 1); ++x) {
    sum += half_taps[abs(x - u)] * line[x] * line_weights[x];
  }
  rows[(get_global_id(2) * height + v) * width + u] = sum;
}

// Second pass: columns, normalised by the weights met. `subtract` 0: out = weights · blurred; 1: out = out − weights ·
// blurred.
__kernel void paper_blur_columns(__global const float* restrict rows, __global const float* restrict weights,
                                 __global const float* restrict norm, __global const float* restrict half_taps,
                                 const int radius, const int width, const int height, const int subtract,
                                 __global float* restrict out) {
  const int u = get_global_id(0);
  const int v = get_global_id(1);
  if (u >= width || v >= height) return;
  __global const float* image = rows + get_global_id(2) * height * width;
  float sum = 0.0f;
  for (int y = max(v - radius, 0); y <= min(v + radius, height - 1); ++y) {
    sum += half_taps[abs(y - v)] * image[y * width + u];
  }
  const int pixel = v * width + u;
  const float value = sum * norm[pixel] * weights[pixel];
  const int at = get_global_id(2) * height * width + pixel;
  out[at] = subtract ? out[at] - value : value;
}

__kernel void paper_weigh(__global const float* restrict images, __global const float* restrict weights,
                          const int pixels, __global float* restrict out) {
  const int i = get_global_id(0);
  if (i >= pixels) return;
  const int at = get_global_id(1) * pixels + i;
  out[at] = images[at] * weights[i];
}

// Products of z = [six forward differences, f, 1, g − f], upper triangle row by row: 45 sums per work-group. Each
// work-item walks its own fixed pixels and the tree is fixed, so the same input gives the same bits. PAPER_GROUP and
// PAPER_SUMS come from the host by -D.
__kernel __attribute__((reqd_work_group_size(PAPER_GROUP, 1, 1))) void paper_moments(
    __global const float* restrict images, __global const float* restrict target,
    __global const float* restrict weights, const float8 inverse_steps, const int pixels,
    __global float* restrict partial_sums) {
  __local float shared_sums[PAPER_SUMS * PAPER_GROUP];
  const int lane = get_local_id(0);
  float sums[PAPER_SUMS];
  for (int n = 0; n < PAPER_SUMS; ++n) sums[n] = 0.0f;
  for (int i = get_global_id(0); i < pixels; i += get_global_size(0)) {
    const float w = weights[i];
    const float f = images[i];
    float z[9];
    z[0] = (images[pixels + i] - f) * inverse_steps.s0;
    z[1] = (images[2 * pixels + i] - f) * inverse_steps.s1;
    z[2] = (images[3 * pixels + i] - f) * inverse_steps.s2;
    z[3] = (images[4 * pixels + i] - f) * inverse_steps.s3;
    z[4] = (images[5 * pixels + i] - f) * inverse_steps.s4;
    z[5] = (images[6 * pixels + i] - f) * inverse_steps.s5;
    z[6] = f;
    z[7] = 1.0f;
    z[8] = target[i] - f;
    int n = 0;
    for (int a = 0; a < 9; ++a) {
      for (int b = a; b < 9; ++b) sums[n++] += w * z[a] * z[b];
    }
  }
  for (int n = 0; n < PAPER_SUMS; ++n) shared_sums[n * PAPER_GROUP + lane] = sums[n];
  for (int half_size = PAPER_GROUP / 2; half_size > 0; half_size /= 2) {
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < half_size) {
      for (int n = 0; n < PAPER_SUMS; ++n) {
        shared_sums[n * PAPER_GROUP + lane] += shared_sums[n * PAPER_GROUP + lane + half_size];
      }
    }
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (lane < PAPER_SUMS) partial_sums[get_group_id(0) * PAPER_SUMS + lane] = shared_sums[lane * PAPER_GROUP];
}
