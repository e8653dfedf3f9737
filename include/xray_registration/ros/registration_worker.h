#pragma once

#include <xray_registration/Calibrate.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "xray_registration/pipeline/calibration_frames.h"
#include "xray_registration/pipeline/frame_mailbox.h"
#include "xray_registration/pipeline/initial_pose_scope.h"
#include "xray_registration/pipeline/node_statistics.h"
#include "xray_registration/pipeline/picture_budget.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/pose_preview.h"
#include "xray_registration/ros/pose_requests.h"
#include "xray_registration/ros/publishers.h"
#include "xray_registration/ros/result_listener.h"
#include "xray_registration/ros/transforms.h"
#include "xray_registration/ros/view_synchroniser.h"
#include "xray_registration/ros/wide_search_task.h"

namespace xray_registration {

/// The one thread that owns the device: takes the newest frame, registers it, publishes what became of it. Public
/// methods may be called from any thread and do not wait for the solve.
class RegistrationWorker {
 public:
  /// What came of a request that the worker has carried out.
  struct Answer {
    bool success = false;
    std::string message;
  };

  /// The others must outlive the worker. Opens the device and loads the CT of the parameters, both on its own thread.
  /// `listener` and `preview` may be null.
  RegistrationWorker(const NodeParameters& parameters, Publishers* publishers, Transforms* transforms,
                     NodeStatistics* statistics, Logger logger, ResultListener* listener = nullptr,
                     PosePreview* preview = nullptr);
  ~RegistrationWorker();

  /// Takes a frame, or answers it at once when it cannot be looked at (switched off, CT being loaded). A frame that
  /// this one replaces is answered as dropped.
  void offer(FrameMessages frame);

  /// Answers an image that cannot become part of a frame.
  void refuseImage(const std_msgs::Header& header, const std::string& reason);

  /// The images' stamps go on elsewhere: tf starts again with them, the pose is kept.
  void stampsWereSet();

  /// Answered at once, without success, while another one is being loaded. Broken when the worker stops before it is
  /// done.
  std::future<Answer> loadCt(const std::string& path, const std::string& series_uid);

  /// Proposes a geometry from the frames seen, and applies nothing. Frames are refused meanwhile. Answered at once
  /// while another one is worked out; broken when the worker stops.
  std::future<Calibrate::Response> calibrate();

  /// Searches the newest frame widely for the CT. Frames are refused meanwhile, and everything else that is asked of
  /// the worker is done between two slices. Answered at once while another search goes on; broken when the worker
  /// stops.
  std::future<WideSearchTask::Answer> localize(const std::shared_ptr<WideSearchTask>& task);

  /// The CT's pose in `frame_id`; an empty one is the first view's optical frame. Resolved at the next frame's stamp.
  /// With the name of a body it is that body's alone; one that is cut out of the CT waits until the CT has a pose.
  void setPose(const RigidTransform& T_frame_ct, const std::string& frame_id, const std::string& body = "");

  /// Draws a pose that somebody tries out over the newest X-ray, between frames. False where that is too soon: another
  /// one waits, or drawing has had its half of the time, and the other half is the frames'.
  bool preview(const PreviewRequest& request);

  /// While somebody moves the CT by hand, frames that would be searched for it (nothing is tracked) are refused.
  void setMovedByHand(bool moved) { moved_by_hand_ = moved; }

  /// Where the voxels of the present CT lie; nothing without one.
  std::optional<VolumeGrid> ctGrid() const;

  /// Mode on_demand: register the next usable frame.
  void registerOnce();

  /// Back to the start: no pose but that of the parameters, no fault. The CT stays.
  void restart(const std::string& why);

  void setEnabled(bool enabled) { enabled_ = enabled; }
  bool enabled() const { return enabled_; }
  void setTuning(const RegistrarOptions& registrar, const TrackerOptions& tracker);

  /// To be called every now and then: what nothing could be said of for too long is LOST.
  void watch();

  /// Optical frame of the first view, once an image has come.
  std::string cameraFrame() const;

  /// Ends the thread; frames that wait are not handled any more. Called by the destructor too.
  void stop();

 private:
  void run();
  void startUp();
  void restartNow(const std::string& why);
  void startFromParameters();
  Answer loadCtNow(const std::string& path, const std::string& series_uid);
  void loadBodiesNow();
  Calibrate::Response calibrateNow();
  void beginSearch(const std::shared_ptr<WideSearchTask>& task);
  std::string searchProblem(WideSearchTask* task);
  std::string searchDepths(const std_msgs::Header& header, WideSearchRange* range) const;
  void advanceSearch(const std::shared_ptr<WideSearchTask>& task);
  void endSearch(WideSearchTask* task, const FrameOutcome& outcome);
  std::string lookUpCamera(const std_msgs::Header& header);
  void keepToCalibrate(const FrameMessages& frame, const FrameOutcome& outcome);
  void publishSurfaces();
  void makeSurfaces(const std::vector<BodyShape>& shapes);
  void updateStatistics();

  void handle(const FrameMessages& frame);
  void refuseUnusable(const std_msgs::Header& header, const std::string& reason);
  std::string heldProblem(const FrameMessages& frame) const;
  void watchNow();
  void loseTrack(const std::string& why);
  std::string takeCameraFrame(const ViewMessage& first);
  void bindCameraFrame(const std::string& frame);
  void forgetCameraFrame();
  std::vector<RawView> rawViews(const FrameMessages& frame, const std::string& camera_frame) const;
  std::string resolvePose(const std_msgs::Header& header);
  bool canRegister(const std_msgs::Header& header) const;
  std::string findCamera(const std_msgs::Header& header);
  FrameOutcome registerFrame(const FrameMessages& frame, const std_msgs::Header& header);
  void publishOutcome(const FrameMessages& frame, const std_msgs::Header& header, const FrameOutcome& outcome);
  void keepPicture(const FrameMessages& frame, const FrameOutcome& outcome);
  void publishPictureIfDue();
  void publishPictures(const FrameMessages& frame, const FrameOutcome& outcome);
  void publishView(std::size_t view, const std_msgs::Header& header, const FrameOutcome& outcome);
  void keepToShow(const FrameMessages& frame, const std_msgs::Header& header);
  void previewNow(const PreviewRequest& request);
  void refuse(const std_msgs::Header& header, const std::string& reason);
  void drop(const FrameMessages& frame);
  void sayUnregistered(const std_msgs::Header& header, const std::string& reason);

  const NodeParameters parameters_;
  Publishers* publishers_;
  Transforms* transforms_;
  NodeStatistics* statistics_;
  Logger logger_;
  ResultListener* listener_;
  PosePreview* preview_;

  FrameMailbox<FrameMessages> mailbox_;
  std::atomic<bool> enabled_{true};
  std::atomic<bool> opening_{true};   ///< The device, at the start.
  std::atomic<bool> loading_{false};  ///< A CT, from the request on.
  std::atomic<bool> calibrating_{false};
  std::atomic<bool> searching_{false};
  std::atomic<bool> watching_{false};    ///< A look is waiting for the worker.
  std::atomic<bool> previewing_{false};  ///< A preview is.
  std::atomic<std::chrono::steady_clock::time_point> next_preview_{};
  std::atomic<bool> moved_by_hand_{false};
  std::atomic<bool> stopping_{false};
  mutable std::mutex camera_frame_mutex_;
  std::string camera_frame_;  ///< Of the newest image of the first view.
  std::string bound_frame_;   ///< Below which results stand in tf; empty: none do.
  mutable std::mutex ct_grid_mutex_;
  std::optional<VolumeGrid> ct_grid_;

  PictureBudget picture_budget_;

  // The worker thread's own.
  /// What pictures are made of.
  struct Shown {
    FrameMessages frame;
    FrameOutcome outcome;
  };
  std::optional<Shown> picture_;  ///< Of the last frame, when it is still to be made.
  RegistrationPipeline pipeline_;
  PoseRequests pose_requests_;
  std::optional<FrameMessages> newest_;  ///< With an image of the first view: what is searched in.
  bool register_requested_ = false;
  std::chrono::steady_clock::time_point last_looked_at_;  ///< When a frame last left the solver.
  InitialPoseScope initial_pose_scope_;
  bool initial_pose_applies_ = true;
  CalibrationFrames calibration_frames_;
  FrameMessages last_to_calibrate_;               ///< The newest of them.
  std::optional<RigidTransform> T_fixed_camera_;  ///< Of the frame at hand; the identity without frames/fixed.
  RigidTransform T_fixed_camera_accepted_ = RigidTransform::Identity();  ///< Of pipeline_.lastAcceptedStamp().
  /// The newest frame that stands somewhere, registered or not.
  struct NewestFrame {
    FrameMessages messages;
    std_msgs::Header header;
    std::vector<std::optional<ViewInput>> views;  ///< Empty until somebody prepares them.
  };
  NewestFrame shown_frame_;
  std::future<void> surface_;
  std::thread thread_;
};

}  // namespace xray_registration
