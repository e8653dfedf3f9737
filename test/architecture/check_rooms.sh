#!/bin/sh
# Fails when a room includes one that does not stand below it. usage: check_rooms.sh <source folder>
set -u
root=$1
status=0

# room: what it may include
allowed() {
  case $1 in
    common) echo "" ;;
    geometry) echo "common" ;;
    volume) echo "common geometry" ;;
    image) echo "common geometry" ;;
    drr) echo "common geometry volume image" ;;
    registration) echo "common geometry volume image drr" ;;
    pipeline) echo "common geometry volume image drr registration" ;;
    evaluation) echo "common geometry volume image drr registration pipeline" ;;
    ros) echo "common geometry volume image drr registration pipeline" ;;
    tools) echo "common geometry volume image drr registration pipeline evaluation ros" ;;
    *) echo "unknown" ;;
  esac
}

check() { # folder room
  for file in $(find "$1" -name '*.h' -o -name '*.hpp' -o -name '*.cpp' 2>/dev/null); do
    for other in $(sed -n 's/^[[:space:]]*#include[[:space:]]*[<"]\(xray_registration\/\)\{0,1\}\([a-z]*\)\/.*/\2/p' "$file" | sort -u); do
      case " common geometry volume image drr registration pipeline evaluation ros tools " in *" $other "*) ;; *) continue ;; esac
      [ "$other" = "$2" ] && continue
      case " $(allowed "$2") " in
        *" $other "*) ;;
        *) echo "$file: room '$2' must not include room '$other'"; status=1 ;;
      esac
    done
  done
}

for room in common geometry volume image drr registration pipeline evaluation ros tools; do
  check "$root/src/$room" $room
  check "$root/include/xray_registration/$room" $room
done

# The core knows no ROS, and only itk_*.cpp of the rooms that read files know ITK.
for room in common geometry volume image drr registration pipeline evaluation; do
  if grep -rnE '#include <(ros|tf2|tf2_ros|sensor_msgs|geometry_msgs|rosbag|image_transport)/' \
      "$root/src/$room" "$root/include/xray_registration/$room" 2>/dev/null; then
    echo "room '$room' belongs to the core and must not include ROS"; status=1
  fi
done
if grep -rlE '#include [<"]itk[A-Z]' "$root/src" "$root/include" | grep -vE 'src/(common|volume|image)/itk_[a-z_]*\.cpp$'; then
  echo "ITK is for itk_*.cpp in src/common, src/volume and src/image only"; status=1
fi
if grep -rlE '#include [<"]gdcm[A-Z]' "$root/src" "$root/include" |
    grep -vE 'src/(image/dicom/gdcm_[a-z_]*|(common|volume|image)/itk_[a-z_]*)\.cpp$'; then
  echo "GDCM is for gdcm_*.cpp in src/image/dicom and itk_*.cpp only"; status=1
fi
# OpenCL stays in drr: the rooms above know its engines and never their device, nor do its headers for them.
opencl='#include [<"](CL/|xray_registration/drr/opencl/)|\<cl::|\<cl_[a-z0-9]+\>'
public=$root/include/xray_registration
# Some of the folders may be missing, which grep takes for a failure.
found=$(grep -rnE "$opencl" "$root/src/registration" "$root/src/pipeline" "$root/src/evaluation" "$root/src/ros" \
          "$public/registration" "$public/pipeline" "$public/evaluation" "$public/ros" "$public/drr/paper" 2>/dev/null
        grep -nE "$opencl" "$public/drr"/*.h /dev/null 2>/dev/null)
if [ -n "$found" ]; then
  echo "$found"
  echo "OpenCL is for room drr only, and its headers outside drr/opencl are for rooms that do not know it"; status=1
fi
[ $status -eq 0 ] && echo "rooms: every include points down"
exit $status
