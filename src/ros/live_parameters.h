#pragma once

#include <dynamic_reconfigure/Config.h>

#include <string>

#include "xray_registration/AcceptConfig.h"
#include "xray_registration/SolverConfig.h"
#include "xray_registration/TrackingConfig.h"
#include "xray_registration/registration/registrar_options.h"
#include "xray_registration/registration/tracker.h"

namespace xray_registration {

/// dynamic_reconfigure's configurations ↔ the options that they change. cfg/*.cfg has the same names and ranges as
/// loadParameters.
AcceptConfig toConfig(const AcceptOptions& options);
SolverConfig toConfig(const RegistrarOptions& options);
TrackingConfig toConfig(const TrackerOptions& options);
/// Why a configuration cannot be applied, which dynamic_reconfigure would let through: a number that is none, a word
/// that is not known. Empty when it can.
std::string problemOf(const AcceptConfig& config);
std::string problemOf(const SolverConfig& config);
std::string problemOf(const TrackingConfig& config);
/// Why a request cannot be meant for a group of parameters, which `known` holds in full: a name that is not there, a
/// value of another kind, or one name twice. Empty when it can.
std::string unknownParameter(const dynamic_reconfigure::Config& asked, const dynamic_reconfigure::Config& known);

void apply(const AcceptConfig& config, AcceptOptions* options);
void apply(const SolverConfig& config, RegistrarOptions* options);
void apply(const TrackingConfig& config, TrackerOptions* options);

}  // namespace xray_registration
