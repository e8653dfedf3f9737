#include "xray_registration/ros/master_watch.h"

#include <ros/connection_manager.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/publication.h>
#include <ros/this_node.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace xray_registration {
namespace {

using XmlRpc::XmlRpcValue;

constexpr std::chrono::seconds kPeriod{1};
constexpr int kLooksBetweenServices = 10;  // The master's whole state is large, and services rarely change.

/// A call of the master's; nothing when it does not answer.
std::optional<XmlRpcValue> ask(const std::string& method, const std::vector<std::string>& arguments = {}) {
  XmlRpcValue request;
  request[0] = ros::this_node::getName();
  for (std::size_t i = 0; i < arguments.size(); ++i) request[static_cast<int>(i) + 1] = arguments[i];
  XmlRpcValue response;
  XmlRpcValue payload;
  if (!ros::master::execute(method, request, response, payload, false)) return std::nullopt;
  return payload;
}

std::optional<int> masterPid() {
  std::optional<XmlRpcValue> pid = ask("getPid");
  if (!pid || pid->getType() != XmlRpcValue::TypeInt) return std::nullopt;
  return static_cast<int>(*pid);
}

/// Those that the master knows to be this process's.
std::optional<std::vector<std::string>> ownServices() {
  std::optional<XmlRpcValue> state = ask("getSystemState");
  if (!state || state->getType() != XmlRpcValue::TypeArray || state->size() < 3) return std::nullopt;
  std::vector<std::string> own;
  XmlRpcValue services = (*state)[2];
  for (int i = 0; i < services.size(); ++i) {
    XmlRpcValue providers = services[i][1];
    for (int k = 0; k < providers.size(); ++k) {
      if (static_cast<std::string>(providers[k]) == ros::this_node::getName()) own.push_back(services[i][0]);
    }
  }
  return own;
}

/// A call of this process's own XML-RPC server: what a master asks of a node.
bool askSelf(const std::string& method, const XmlRpcValue& request, XmlRpcValue* response) {
  const ros::XMLRPCManagerPtr& manager = ros::XMLRPCManager::instance();
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(manager->getServerURI(), host, port)) return false;
  XmlRpc::XmlRpcClient* client = manager->getXMLRPCClient(host, static_cast<int>(port), "/");
  const bool done = client->execute(method.c_str(), request, *response);
  manager->releaseXMLRPCClient(client);
  return done;
}

/// URIs of those who publish to a subscription of this process now: they need not know the new master.
std::vector<std::string> connectedPublishers(const std::string& topic) {
  XmlRpcValue request;
  request[0] = ros::this_node::getName();
  XmlRpcValue response;
  std::vector<std::string> uris;
  if (!askSelf("getBusInfo", request, &response) || response.size() < 3) return uris;
  XmlRpcValue connections = response[2];  // [id, who, direction, transport, topic, …]
  for (int i = 0; i < connections.size(); ++i) {
    XmlRpcValue connection = connections[i];
    if (connection.size() < 5 || static_cast<std::string>(connection[2]) != "i") continue;
    if (static_cast<std::string>(connection[4]) == topic) uris.push_back(connection[1]);
  }
  return uris;
}

void connectTo(const std::string& topic, XmlRpcValue registered) {
  std::vector<std::string> uris = connectedPublishers(topic);
  for (int i = 0; i < registered.size(); ++i) {
    const std::string uri = registered[i];
    if (std::find(uris.begin(), uris.end(), uri) == uris.end()) uris.push_back(uri);
  }
  XmlRpcValue request;
  request[0] = "/master";
  request[1] = topic;
  request[2].setSize(static_cast<int>(uris.size()));
  for (std::size_t i = 0; i < uris.size(); ++i) request[2][static_cast<int>(i)] = uris[i];
  XmlRpcValue response;
  askSelf("publisherUpdate", request, &response);
}

int registerPublishers(const std::string& uri) {
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  int done = 0;
  for (const std::string& topic : topics) {
    const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
    if (publication && ask("registerPublisher", {topic, publication->getDataType(), uri})) ++done;
  }
  return done;
}

int registerSubscribers(const std::string& uri) {
  ros::V_string topics;
  ros::this_node::getSubscribedTopics(topics);
  int done = 0;
  for (const std::string& topic : topics) {
    const std::optional<XmlRpcValue> publishers = ask("registerSubscriber", {topic, "*", uri});
    if (!publishers) continue;
    connectTo(topic, *publishers);
    ++done;
  }
  return done;
}

int registerServices(const std::vector<std::string>& services, const std::string& uri) {
  const std::string rpc =
      "rosrpc://" + ros::network::getHost() + ":" + std::to_string(ros::ConnectionManager::instance()->getTCPPort());
  return static_cast<int>(std::count_if(services.begin(), services.end(), [&](const std::string& service) {
    return ask("registerService", {service, rpc, uri}).has_value();
  }));
}

}  // namespace

MasterWatch::MasterWatch(Logger logger) : logger_(std::move(logger)), thread_([this] { run(); }) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void MasterWatch::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!changed_.wait_for(lock, kPeriod, [this] { return stopping_; })) {
    lock.unlock();
    look();
    lock.lock();
  }
}

void MasterWatch::look() {
  const std::optional<int> pid = masterPid();
  if (!pid) {
    if (!gone_) {
      log(logger_, LogLevel::kError,
          "the ROS master at " + ros::master::getURI() +
              " does not answer: what is connected goes on, and nobody new can connect until it is back");
    }
    gone_ = true;
    return;
  }
  const bool is_new = gone_ || (pid_ && pid_ != pid);
  pid_ = pid;
  gone_ = false;
  if (is_new) {
    const std::string uri = ros::XMLRPCManager::instance()->getServerURI();
    const int publishers = registerPublishers(uri);
    const int subscribers = registerSubscribers(uri);
    const int services = registerServices(services_, uri);
    log(logger_, LogLevel::kWarning,
        "the ROS master is back: registered " + std::to_string(publishers) + " published topics, " +
            std::to_string(subscribers) + " subscribed ones and " + std::to_string(services) + " services again");
  } else if (looks_++ % kLooksBetweenServices == 0) {
    if (const auto services = ownServices()) services_ = *services;
  }
}

}  // namespace xray_registration
