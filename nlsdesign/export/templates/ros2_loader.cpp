// Makes the transmission from a robot's description, as a plug-in of ros2_control.
#include <exception>
#include <memory>
#include <string>

#include "pluginlib/class_list_macros.hpp"
#include "transmission_interface/transmission_loader.hpp"

#include "@name@_transmission.hpp"

namespace @name@_ros2
{
class Loader : public transmission_interface::TransmissionLoader
{
public:
    // Wrong numbers are told by what std::stod and the transmission throw.
    std::shared_ptr<transmission_interface::Transmission> load(
        const hardware_interface::TransmissionInfo &info) override
    {
        const auto &joint = info.joints.at(0);
        const auto given = info.parameters.find("effort_per_command");
        const double effort = given == info.parameters.end() ? 1.0 : std::stod(given->second);
        return std::make_shared<ElasticTransmission>(joint.mechanical_reduction, joint.offset, effort);
    }
};
}  // namespace @name@_ros2

PLUGINLIB_EXPORT_CLASS(@name@_ros2::Loader, transmission_interface::TransmissionLoader)
