// X-ray pyramid: weighted mean over 2 × 2 pixels; the weight is the mean weight, zero below a half.
__kernel void halve_xray(__global const float* xray, __global const float* weight, const int width, const int height,
                         const int half_width, const int half_height, __global float* half_xray,
                         __global float* half_weight) {
  const int i = get_global_id(0);
  if (i >= half_width * half_height) return;
  const int u = 2 * (i % half_width), v = 2 * (i / half_width);
  float total = 0.0f, total_weight = 0.0f, plain = 0.0f;
  for (int dv = 0; dv < 2; ++dv) {
    for (int du = 0; du < 2; ++du) {
      const int pixel = (v + dv) * width + u + du;
      total = fma(weight[pixel], xray[pixel], total);
      total_weight += weight[pixel];
      plain += xray[pixel];
    }
  }
  half_xray[i] = total_weight > 0.0f ? total / total_weight : 0.25f * plain;
  half_weight[i] = total_weight >= 2.0f ? 0.25f * total_weight : 0.0f;
}

// Whether any pixel of a tile has weight and lies in the box [x, z) × [y, w), and how much the X-ray varies in it. With
// `begins` tiles beside the box are not used, else they are what they were.
__kernel void used_tiles(__global const float* xray, __global const float* weight, const int width, const int height,
                         const int tiles_x, const int tiles, const float4 box, const int begins,
                         __global int* used, __global float* contrast) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  const int2 origin = tile_origin(tile, tiles_x);
  if (origin.x >= box.z || origin.x + TILE <= box.x || origin.y >= box.w || origin.y + TILE <= box.y) {
    if (begins) {
      used[tile] = 0;
      contrast[tile] = 0.0f;
    }
    return;
  }
  const float reference = xray[origin.y * width + origin.x];
  float n = 0.0f, sum = 0.0f, sum2 = 0.0f;
  for (int v = origin.y; v < min(origin.y + TILE, height); ++v) {
    for (int u = origin.x; u < min(origin.x + TILE, width); ++u) {
      const float w = weight[v * width + u], x = xray[v * width + u] - reference;
      n += w;
      sum += w * x;
      sum2 += w * x * x;
    }
  }
  used[tile] = n > 0.0f;
  contrast[tile] = n > 0.0f ? fmax(sum2 / n - sum * sum / (n * n), 0.0f) : 0.0f;
}

// Adds an image to what surrounds a body, or begins with it.
__kernel void surround(__global const float* image, const int pixels, const int begins, __global float* surroundings) {
  const int i = get_global_id(0);
  if (i < pixels) surroundings[i] = image[i] + (begins ? 0.0f : surroundings[i]);
}

// Tiles that touch the box [x, z) × [y, w) are not used.
__kernel void leave_out_tiles(const int tiles_x, const int tiles, const float4 box, __global int* used,
                              __global float* contrast) {
  const int tile = get_global_id(0);
  if (tile >= tiles) return;
  const int2 origin = tile_origin(tile, tiles_x);
  if (origin.x < box.z && origin.x + TILE > box.x && origin.y < box.w && origin.y + TILE > box.y) {
    used[tile] = 0;
    contrast[tile] = 0.0f;
  }
}
