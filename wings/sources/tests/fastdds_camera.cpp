// A ROS 2 camera's driver in software, over eProsima Fast DDS, which most of ROS 2 uses (Debian: libfastrtps-dev).
//
//     g++ -std=c++17 -O1 fastdds_camera.cpp -lfastrtps -lfastcdr -o fastdds_camera
//     fastdds_camera DOMAIN [WIDTH HEIGHT SECONDS FILE.raw ...]
//
// Publishes sensor_msgs/msg/Image on /camera/image_raw, in mono8, 20 a second: 320x240, pixel (x, y) of picture n is
// (x + y + 16 n) mod 256; or files of one byte a pixel, each for some seconds, with the lowest bit turned in every other
// picture. Serves /camera/set_camera_info as rmw_fastrtps does: the request's identity stands beside the
// message. Says on standard output what happens, a line each: `ready`, `info` and the request's bytes in hexadecimal.

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<uint8_t>;

// Messages as bytes, from their encapsulation header on.
class Raw : public TopicDataType {
public:
    explicit Raw(const char* name) {
        setName(name);
        m_typeSize = 1 << 20;
        m_isGetKeyDefined = false;
    }
    bool serialize(void* data, Payload* payload) override {
        const Bytes& bytes = *static_cast<Bytes*>(data);
        memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(Payload* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

static void whole(Bytes& bytes, uint32_t value) {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<uint8_t>(value >> shift));
}

static void text(Bytes& bytes, const std::string& text) {
    whole(bytes, static_cast<uint32_t>(text.size() + 1));
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.push_back(0);
}

struct Shown {
    uint32_t width = 320, height = 240;
    double seconds = 1;
    std::vector<Bytes> files;
};

static Bytes image(const Shown& shown, uint32_t number) {
    const auto& [width, height, seconds, files] = shown;
    const auto now = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
    Bytes bytes{0, 1, 0, 0};
    whole(bytes, static_cast<uint32_t>(now / 1000000000));
    whole(bytes, static_cast<uint32_t>(now % 1000000000));
    text(bytes, "optical");
    whole(bytes, height);
    whole(bytes, width);
    text(bytes, "mono8");
    bytes.push_back(0);
    whole(bytes, width);
    whole(bytes, width * height);
    if (!files.empty()) {
        const Bytes& file = files[static_cast<size_t>(number / (20 * seconds)) % files.size()];
        for (uint8_t value : file) bytes.push_back(value ^ (number & 1));
        return bytes;
    }
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) bytes.push_back(static_cast<uint8_t>(x + y + 16 * number));
    return bytes;
}

int main(int count, char** arguments) {
    Shown shown;
    if (count > 4) {
        shown.width = std::stoi(arguments[2]);
        shown.height = std::stoi(arguments[3]);
        shown.seconds = std::stod(arguments[4]);
    }
    for (int at = 5; at < count; ++at) {
        std::ifstream file(arguments[at], std::ios::binary);
        shown.files.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    auto* participant = DomainParticipantFactory::get_instance()->create_participant(std::stoi(arguments[1]), PARTICIPANT_QOS_DEFAULT);
    auto topic = [&](const char* name, const char* type) {
        TypeSupport(new Raw(type)).register_type(participant);
        return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    };
    auto* publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    auto* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    DataWriterQos sends = DATAWRITER_QOS_DEFAULT;
    sends.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    sends.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
    DataReaderQos receives = DATAREADER_QOS_DEFAULT;
    receives.reliability().kind = RELIABLE_RELIABILITY_QOS;
    receives.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
    auto* images = publisher->create_datawriter(topic("rt/camera/image_raw", "sensor_msgs::msg::dds_::Image_"), sends);
    auto* requests = subscriber->create_datareader(topic("rq/camera/set_camera_infoRequest", "sensor_msgs::srv::dds_::SetCameraInfo_Request_"), receives);
    auto* responses = publisher->create_datawriter(topic("rr/camera/set_camera_infoReply", "sensor_msgs::srv::dds_::SetCameraInfo_Response_"), sends);
    puts("ready");
    fflush(stdout);
    for (uint32_t number = 0;; ++number) {
        Bytes picture = image(shown, number);
        images->write(&picture);
        Bytes request;
        SampleInfo info;
        while (requests->take_next_sample(&request, &info) == ReturnCode_t::RETCODE_OK) {
            if (!info.valid_data) continue;
            printf("info ");
            for (uint8_t byte : request) printf("%02x", byte);
            puts("");
            fflush(stdout);
            // rmw_fastrtps: the reader of the answers stands in the place of the writer, if it was named.
            auto identity = info.sample_identity;
            if (info.related_sample_identity.writer_guid() != eprosima::fastrtps::rtps::GUID_t::unknown())
                identity.writer_guid(info.related_sample_identity.writer_guid());
            eprosima::fastrtps::rtps::WriteParams parameters;
            parameters.related_sample_identity(identity);
            Bytes answer{0, 1, 0, 0, 1};
            text(answer, "stored");
            responses->write(&answer, parameters);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}
