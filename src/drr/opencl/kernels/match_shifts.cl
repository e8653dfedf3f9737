// How well a DRR resembles an X-ray, wherever it is shifted to: masked normalised correlation.
//
// A work-item takes so many neighbouring shifts at once, which become vector code on a CPU. It may read, and not use, as
// many pixels behind the last image.
#if LANES > 1
#define AT_ONCE SHIFTS_AT_ONCE
#else
#define AT_ONCE 1
#endif
#define FOR_SHIFTS for (int i = 0; i < AT_ONCE; ++i)

// What stands out of a DRR's surroundings, the mean over a box, where the CT is seen or nearly so; and where that is.
__kernel void outline(__global const float* drr, const int width, const int height, const int count, const int radius,
                      const float least_shadow, __global float* detail, __global float* shown) {
  const int at = get_global_id(0);
  if (at >= count) return;
  const int column = at % width, row = (at / width) % height;
  __global const float* image = drr + at / (width * height) * (width * height);
  const int left = max(column - radius, 0), right = min(column + radius, width - 1);
  const int top = max(row - radius, 0), bottom = min(row + radius, height - 1);
  float sum = 0.0f, nearby = 0.0f;
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      const float value = image[v * width + u];
      sum += value;
      if (abs(u - column) <= 1 && abs(v - row) <= 1) nearby = fmax(nearby, value);
    }
  }
  const int is_shown = nearby > least_shadow;
  shown[at] = is_shown ? 1.0f : 0.0f;
  detail[at] = is_shown ? drr[at] - sum / (float)((right - left + 1) * (bottom - top + 1)) : 0.0f;
}

INLINE float shift_correlation(float n, float x, float xx, float t, float tt, float xt, float least, float flat) {
  const float inv_n = 1.0f / fmax(n, 1.0f);
  const float var_x = xx * inv_n - x * inv_n * x * inv_n, var_t = tt * inv_n - t * inv_n * t * inv_n;
  const float cov = xt * inv_n - x * inv_n * t * inv_n;
  // A DRR that hardly varies resembles everything.
  const int counts = n >= least && var_t > 1e-3f * tt * inv_n;
  return counts ? cov * rsqrt(fmax(var_x, flat) * var_t) : -1.0f;
}

// One group per pose and row of shifts. An X-ray's pixel is its value, and 1 where it may be used. Over the whole X-ray,
// whose values have mean 0 there.
__kernel void match_everywhere(__global const float* drr, const int width, const int height,
                               __global const float2* xray, const int xray_width, const int xray_height,
                               const int shifts, const float pixels, const float power, __global float* correlations) {
  __global const float* image = drr + get_group_id(0) / shifts * (width * height);
  const int down = get_group_id(0) % shifts;
  for (int first = get_local_id(0) * AT_ONCE; first < shifts; first += get_local_size(0) * AT_ONCE) {
    float t[AT_ONCE], tt[AT_ONCE], xt[AT_ONCE];
    FOR_SHIFTS t[i] = tt[i] = xt[i] = 0.0f;
    for (int v = 0; v < xray_height; ++v) {
      for (int u = 0; u < xray_width; ++u) {
        const float2 pixel = xray[v * xray_width + u];
        if (pixel.y == 0.0f) continue;
        __global const float* seen = image + (v + down) * width + u + first;
        FOR_SHIFTS {
          const float value = seen[i];
          t[i] += value;
          tt[i] = fma(value, value, tt[i]);
          xt[i] = fma(value, pixel.x, xt[i]);
        }
      }
    }
    for (int i = 0; i < AT_ONCE && first + i < shifts; ++i) {
      correlations[get_group_id(0) * shifts + first + i] =
          shift_correlation(pixels, 0.0f, power, t[i], tt[i], xt[i], 1.0f, 0.0f);
    }
  }
}

// The same over what the CT shows of itself.
__kernel void match_shown(__global const float* detail, __global const float* shown, const int width, const int height,
                          __global const float2* xray, const int xray_width, const int xray_height, const int shifts,
                          const float least_share, const float flat, __global float* correlations) {
  const int pixels = width * height;
  __global const float* image = detail + get_group_id(0) / shifts * pixels;
  __global const float* where = shown + get_group_id(0) / shifts * pixels;
  const int down = get_group_id(0) % shifts;
  float all = 0.0f;
  for (int i = 0; i < pixels; ++i) all += where[i];
  const float least = least_share * fmin(all, (float)(xray_width * xray_height));
  for (int first = get_local_id(0) * AT_ONCE; first < shifts; first += get_local_size(0) * AT_ONCE) {
    float n[AT_ONCE], x[AT_ONCE], xx[AT_ONCE], t[AT_ONCE], tt[AT_ONCE], xt[AT_ONCE];
    FOR_SHIFTS n[i] = x[i] = xx[i] = t[i] = tt[i] = xt[i] = 0.0f;
    for (int v = 0; v < xray_height; ++v) {
      for (int u = 0; u < xray_width; ++u) {
        const float2 pixel = xray[v * xray_width + u];
        if (pixel.y == 0.0f) continue;
        const int at = (v + down) * width + u + first;
        const float square = pixel.x * pixel.x;
        FOR_SHIFTS {
          const float value = image[at + i], used = where[at + i];
          n[i] += used;
          x[i] = fma(used, pixel.x, x[i]);
          xx[i] = fma(used, square, xx[i]);
          t[i] += value;
          tt[i] = fma(value, value, tt[i]);
          xt[i] = fma(value, pixel.x, xt[i]);
        }
      }
    }
    for (int i = 0; i < AT_ONCE && first + i < shifts; ++i) {
      correlations[get_group_id(0) * shifts + first + i] =
          shift_correlation(n[i], x[i], xx[i], t[i], tt[i], xt[i], least, flat);
    }
  }
}
